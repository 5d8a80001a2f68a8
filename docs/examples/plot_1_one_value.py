"""One value of a style
====================

A config that extends another changes single values. Here the ends of the shipped default's locks are drawn together less, then more.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt

from pipeline.cli.main import call

folder = Path(tempfile.mkdtemp())
small = ["groom.strands=8000", "groom.guides=150", "simulate.frames=1", "render.size=[300, 340]"]

# %%
# Every run gets a name of its own, so that its caches and frames lie in a folder of their own. What the runs share, here the head and
# the roots, they make again: it takes less than a second.

strengths = (0.0, 0.65, 0.95)
for strength in strengths:
    values = [*small, f"name=locks-{strength}", f"groom.style.locks.strength={strength}"]
    call(
        ["run", "../../configs/default.toml", "--outputs", str(folder)]
        + [word for value in values for word in ("-s", value)]
    )

# %%

figure, axes = plt.subplots(1, 3, figsize=(9, 3.6))
for axis, strength in zip(axes, strengths, strict=True):
    axis.imshow(plt.imread(folder / f"locks-{strength}" / "frames" / "0001.png"))
    axis.set_title(f"groom.style.locks.strength = {strength}", fontsize=8)
    axis.axis("off")
figure.tight_layout()
