"""What colours a fibre from root to tip: melanin and dye, with its roughness, and how strands differ.

All strands share one table: absorption of R, G and B and the variance of the lobes at K places from root to tip, for J
amounts of melanin more or less than usual. A strand carries three numbers, its variation: where between the least and the
most melanin it is (0 .. 1), a factor on the variance of its lobes, and by how much of its length it is along of others.

Absorption is that of melanin plus that of dye: pigment only ever takes light away, so bright colours need light hair. A
dye's follows from the colour c that much white hair shows with it, where light is scattered many times,

    sigma_a = (ln c / (5.969 - 0.215 b + 2.532 b^2 - 10.73 b^3 + 5.574 b^4 + 0.245 b^5))^2,  b the azimuthal roughness.

Source: Chiang et al., A Practical and Controllable Hair and Fur Model for Production Path Tracing, Eurographics 2016, eq. 9.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from pipeline.config.schema import Fibre
from pipeline.render.fibre import variance
from pipeline.strands.random import normal

_F32 = NDArray[np.float32]
_F64 = NDArray[np.float64]

_PLACES, _AMOUNTS = 65, 17
_SPREAD: Final = 2.0
"""Standard deviations to which variation is cut off."""
_MELANIN_MOST: Final = 0.99
_DARKEST: Final = 1e-3
"""Least part of light that a dye's colour returns in a channel."""
_ROUGHNESS = (0.1, 1.0)
_MELANIN, _ROUGHER, _ALONG = 31, 32, 33  # salts

_EUMELANIN: Final = np.array([0.506, 0.841, 1.653])
_PHEOMELANIN: Final = np.array([0.343, 0.733, 1.924])


def absorption(melanin: _F64 | float, redness: _F64 | float) -> _F64:
    """Absorption (..., 3) [1/radius] for R, G, B of hair with this melanin (...), 0 .. 1.

    Redness (...) is the share of pheomelanin. Source: d'Eon et al., An Energy-Conserving Hair Reflectance Model, EGSR 2011,
    for the two spectra; the logarithm, which makes equal steps of melanin look equal, is that of Cycles' principled hair.
    """
    amount = -np.log(np.maximum(1 - np.asarray(melanin, np.float64), 1e-4))
    red = np.asarray(redness, np.float64)[..., None]
    spectrum: _F64 = amount[..., None] * ((1 - red) * _EUMELANIN + red * _PHEOMELANIN)
    return spectrum


def dye_absorption(colour: tuple[float, float, float], azimuthal_roughness: float) -> _F64:
    """Absorption (3,) [1/radius] of a dye that gives white hair this colour, sRGB in 0 .. 1 (Chiang et al. 2016, eq. 9)."""
    encoded = np.array(colour, np.float64)
    linear = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    b = azimuthal_roughness
    scale = 5.969 - 0.215 * b + 2.532 * b**2 - 10.73 * b**3 + 5.574 * b**4 + 0.245 * b**5
    sigma: _F64 = (np.log(np.clip(linear, _DARKEST, 1)) / scale) ** 2
    return sigma


def table(hair: Fibre) -> _F32:
    """(K, J, 4) float32: absorption R, G, B [1/radius], and variance over that of `hair.roughness`.

    Over the place from root to tip, and melanin from the least to the most that varies from strand to strand.
    """
    at = np.linspace(0, 1, _PLACES if hair.along else 2)
    more = hair.melanin_jitter * np.linspace(-_SPREAD, _SPREAD, _AMOUNTS if hair.melanin_jitter else 2)
    melanin = np.clip(_along(hair, "melanin", at)[:, None] + more, 0, _MELANIN_MOST)
    sigma = absorption(melanin, _along(hair, "redness", at)[:, None])
    if hair.dye is not None:
        taken = dye_absorption(hair.dye.colour, hair.azimuthal_roughness)
        sigma = sigma + _along(hair, "dye", at)[:, None, None] * taken
    rough = _relative(_along(hair, "roughness", at), hair.roughness)[:, None, None]
    return np.concatenate([sigma, np.broadcast_to(rough, (*melanin.shape, 1))], axis=-1).astype(np.float32)


def variation(hair: Fibre, seed: int, key: NDArray[np.uint32]) -> _F32:
    """(S, 3) float32: how strands with these random keys (S,) differ, see above."""
    melanin, rougher, along = (
        np.clip(normal(seed, key, salt), -_SPREAD, _SPREAD) for salt in (_MELANIN, _ROUGHER, _ALONG)
    )
    return np.stack(
        [
            (melanin / _SPREAD + 1) / 2,
            _relative(hair.roughness + hair.roughness_jitter * rougher, hair.roughness),
            hair.along_jitter * along,
        ],
        axis=-1,
    ).astype(np.float32)


def _along(hair: Fibre, what: str, at: _F64) -> _F64:
    """A value at places (K,): linear between the stops that set it, the hair's own if none does."""
    stops = [(stop.at, value) for stop in hair.along if (value := getattr(stop, what)) is not None]
    if stops:
        places, values = np.array(stops).T
        return np.asarray(np.interp(at, places, values))
    own = (hair.dye.amount if hair.dye else 0.0) if what == "dye" else getattr(hair, what)
    return np.full(at.shape, float(own))


def _relative(roughness: _F64, usual: float) -> _F64:
    """Variance of the lobes at roughnesses (...) over that at the usual one."""
    ratio: _F64 = variance(np.clip(roughness, *_ROUGHNESS)) / variance(usual)
    return ratio
