"""What the raster should draw: strands as opaque bands, by many samples a pixel and a depth buffer."""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

NEAR, FAR = 1.0, 3.0
EYE = 2.0  # [m] from the plane z = 0, on which a metre is half the picture's height


def matrix(width: int, height: int) -> Floats:
    """A camera at (0, 0, EYE) that looks along -z: world to clip space (4, 4)."""
    slope = 2.0  # half the height at distance EYE is 1 m
    return np.array(
        [
            [slope * height / width, 0, 0, 0],
            [0, slope, 0, 0],
            [
                0,
                0,
                -(FAR + NEAR) / (FAR - NEAR),
                EYE * (FAR + NEAR) / (FAR - NEAR) - 2 * FAR * NEAR / (FAR - NEAR),
            ],
            [0, 0, -1, EYE],
        ]
    )


def scale(height: int) -> float:
    """Half width [px] of a unit radius at unit distance."""
    return 2.0 * height / 2


def project(points: NDArray[np.float32], width: int, height: int) -> tuple[Floats, Floats]:
    """Screen positions (..., 2) [px] and distances (...,) [m]."""
    x = (
        np.concatenate([points.astype(float), np.ones((*points.shape[:-1], 1))], axis=-1)
        @ matrix(width, height).T
    )
    w = x[..., 3]
    return np.stack([(x[..., 0] / w + 1) * width / 2, (1 - x[..., 1] / w) * height / 2], axis=-1), w


def drawn(
    points: NDArray[np.float32],
    widths: NDArray[np.float32],
    colours: NDArray[np.float32],
    background: Floats,
    per_side: int,
) -> Floats:
    """Linear RGB (H, W, 3) of strands (S, P, 3) over a background (H, W, 3), per_side^2 samples a pixel."""
    height, width = background.shape[:2]
    at, w = project(points, width, height)
    half = scale(height) * widths / 2 / w
    place = (np.arange(per_side) + 0.5) / per_side
    y, x = np.meshgrid(*((np.arange(n)[:, None] + place).ravel() for n in (height, width)), indexing="ij")
    nearest, picture = np.full(y.shape, np.inf), np.repeat(np.repeat(background, per_side, 0), per_side, 1)
    for s in range(len(points)):
        for j in range(points.shape[1] - 1):
            a, b = at[s, j], at[s, j + 1]
            length, reach = np.linalg.norm(b - a), half[s, j : j + 2].max() + 1
            low, high = (np.minimum(a, b) - reach) * per_side, (np.maximum(a, b) + reach) * per_side
            box = tuple(slice(max(int(low[k]), 0), max(int(high[k]), 0)) for k in (1, 0))
            u = ((x[box] - a[0]) * (b - a)[0] + (y[box] - a[1]) * (b - a)[1]) / length**2
            v = np.abs((x[box] - a[0]) * (b - a)[1] - (y[box] - a[1]) * (b - a)[0]) / length
            depth = 1 / (1 / w[s, j] + u * (1 / w[s, j + 1] - 1 / w[s, j]))
            wide = half[s, j] + u * (half[s, j + 1] - half[s, j])
            inside = (u >= 0) & (u < 1) & (v <= wide) & (depth < nearest[box])
            nearest[box][inside] = depth[inside]
            picture[box][inside] = (colours[s, j] + u[..., None] * (colours[s, j + 1] - colours[s, j]))[
                inside
            ]
    return picture.reshape(height, per_side, width, per_side, 3).mean(axis=(1, 3))
