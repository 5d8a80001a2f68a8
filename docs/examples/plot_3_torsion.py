"""Three models of torsion under a shake
=====================================

The same ringlets, shaken by the head for a second and then left alone, with each of the three models of torsion. What the diagnostics of
``guides.h5`` hold is plotted: elastic energy that has not gone back to its rest value is a curl that has not come back.
"""

import tempfile
from pathlib import Path

import h5py
import matplotlib.pyplot as plt

from pipeline.cli.main import call

folder = Path(tempfile.mkdtemp())
MODELS = ("frenet", "rotor", "kirchhoff")
VALUES = (
    "groom.strands=60",
    "groom.guides=60",
    "simulate.frames=72",
    'simulate.rest="groom"',
    'simulate.hair_contact.method="none"',
    'simulate.motion.preset="shake"',
    'simulate.motion.period="0.5 s"',
    "simulate.motion.swings=2",
)
for model in MODELS:
    settings = [*VALUES, f'name="shaken-{model}"', f'simulate.torsion="{model}"']
    call(
        ["run", "../../configs/curly.toml", "--until", "simulate", "--outputs", str(folder)]
        + [word for value in settings for word in ("-s", value)]
    )

# %%

figure, axes = plt.subplots(1, 2, figsize=(9, 3.4))
for model in MODELS:
    with h5py.File(folder / f"shaken-{model}" / "guides.h5") as file:
        energies = {name: file[f"diagnostics/{name}"][:] for name in ("bending", "torsion", "kinetic")}
    seconds = [frame / 24 for frame in range(len(energies["bending"]))]
    axes[0].plot(seconds, (energies["bending"] + energies["torsion"]) * 1e6, label=model)
    axes[1].semilogy(seconds, energies["kinetic"] * 1e6, label=model)
axes[0].set(xlabel="s", title="elastic energy [µJ]")
axes[1].set(xlabel="s", title="kinetic energy [µJ]")
axes[0].legend(frameon=False)
figure.tight_layout()
