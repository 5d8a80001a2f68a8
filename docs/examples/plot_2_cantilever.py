"""A hair that bends under its own weight
======================================

An experiment of a few strands: straight, clamped at their roots, level, and let go. How far a strand droops is set by one number, the
weight of the strand over its stiffness, Gamma = w L³ / (E I); the simulation is held against the equations of the rod.
"""

import tempfile
from pathlib import Path

import h5py
import matplotlib.pyplot as plt
import numpy as np
from scipy.integrate import solve_bvp

from pipeline.cli.main import call

CONFIG = """
name = "cantilever-{length}"
scene = {{ head = "none" }}
groom = {{ source = "swatch", strands = 1, guides = 1, points = 64, swatch = {{ length = {length}, direction = [1.0, 0.0, 0.0] }} }}

[simulate]
frames = 1
settle = "6 s"
rest = "groom" # straight by nature: it hangs as its weight has it
torsion = "none"
hair = {{ radius = "40 um", young_modulus = "4 GPa", density = 1300, damping = "50 ms" }}
hair_contact = {{ method = "none" }}
"""
LENGTHS = (0.03, 0.05, 0.07, 0.10)  # [m]
folder = Path(tempfile.mkdtemp())

# %%
# Stage files are HDF5: ``guides.h5`` holds the points of every frame, one after the other.


def hanging(length):
    config = folder / "cantilever.toml"
    config.write_text(CONFIG.format(length=length))
    call(["run", str(config), "--until", "simulate", "--outputs", str(folder)])
    with h5py.File(folder / f"cantilever-{length}" / "guides.h5") as file:
        points = file["VTKHDF/Points"][:64]
    return points - points[0]


simulated = [hanging(length) for length in LENGTHS]

# %%
# The rod: B theta'' = w (L - s) cos(theta), clamped level at s = 0, free of moment at s = L. What clamps a strand is its first segment,
# and the bend at the next point is that of half a segment on each side: the rod begins at the middle of the first one.

radius, young, density = 40e-6, 4e9, 1300.0
stiffness = young * np.pi / 4 * radius**4
weight = density * np.pi * radius**2 * 9.81


def rod(length, clamp):
    length = length - clamp
    s = np.linspace(0, length, 200)
    found = solve_bvp(
        lambda s, y: [y[1], weight / stiffness * (length - s) * np.cos(y[0])],
        lambda root, tip: [root[0], tip[1]],
        s,
        [-np.linspace(0, 1, 200), -np.ones(200)],
        tol=1e-8,
    )
    theta = found.sol(s)[0]
    edges = np.stack([np.cos(theta), np.sin(theta)])
    middles = (edges[:, 1:] + edges[:, :-1]) / 2 * (s[1] - s[0])
    return np.concatenate([[[0, clamp], [0, 0]], middles], axis=1).cumsum(axis=1)


# %%

figure, axis = plt.subplots(figsize=(7, 4.2))
for length, points in zip(LENGTHS, simulated, strict=True):
    exact = rod(length, clamp=length / 63 / 2)
    gamma = weight * length**3 / stiffness
    (line,) = axis.plot(*exact * 100, label=f"{length * 100:g} cm, Gamma = {gamma:.2g}")
    axis.plot(*points[::3, :2].T * 100, "o", color=line.get_color(), markersize=3.5)
    miss = np.linalg.norm(points[-1, :2] - exact[:, -1]) / length
    print(f"{length * 100:4g} cm: tip {100 * miss:.2f} % of the length from the rod's")
axis.set(xlabel="cm", ylabel="cm", aspect="equal", title="lines: rod equations; dots: ringlet")
axis.legend(frameon=False, fontsize=8)
figure.tight_layout()
