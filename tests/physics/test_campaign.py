"""Every kind of hair survives a head shake with kicks: the short form of `ringlet bench campaign`."""

import numpy as np

from pipeline.bench.campaign import KINDS, campaign, flipped


def test_shaken_hair_holds_at_every_step_and_comes_home() -> None:
    found = list(campaign(seconds=1.0, rates=(60,)))
    for run in found:
        print(run)
        assert run.finite, run
        assert run.strain <= 1.001e-4, run
        assert run.depth <= 1e-4, run
        assert run.astray == 0, run
        assert run.flipped == 0, run
        assert run.speed < 0.5, run
    assert {run.kind for run in found} == set(KINDS)


def test_a_half_turn_of_a_helix_after_one_segment_is_one_flipped_dihedral() -> None:
    along = np.linspace(0, 4 * np.pi, 32)
    helix = np.stack([np.cos(along), np.sin(along), 0.3 * along], axis=1)[None]
    axis = helix[0, 16] - helix[0, 15]
    axis /= np.linalg.norm(axis)
    tail = helix[:, 16:] - helix[:, 15:16]
    turned = helix.copy()
    turned[:, 16:] = helix[:, 15:16] + 2 * (tail @ axis)[..., None] * axis - tail
    found = flipped(helix, turned), flipped(helix, helix)
    print(found)
    assert found == (1, 0)
