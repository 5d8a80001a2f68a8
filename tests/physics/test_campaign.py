"""Every kind of hair survives a head shake with kicks: the short form of `ringlet bench campaign`."""

from pipeline.bench.campaign import KINDS, campaign


def test_shaken_hair_holds_at_every_step_and_comes_home() -> None:
    found = list(campaign(seconds=1.0, rates=(60,)))
    for run in found:
        print(run)
        assert run.finite, run
        assert run.strain <= 1.001e-4, run
        assert run.depth <= 1e-4, run
        assert run.astray == 0, run
        assert run.speed < 0.5, run
    assert {run.kind for run in found} == set(KINDS)
