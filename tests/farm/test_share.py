"""Workers of one machine leave one another the processors."""

import os

import pytest

pytest.importorskip("distributed", reason='needs the extra "farm"')
from pipeline.farm.cluster import connected, local_cluster, share


def surroundings() -> dict[str, str | float | bool]:
    """What a worker's process was told."""
    import dask

    names = (
        "RINGLET_THREADS",
        "OMP_NUM_THREADS",
        "LP_NUM_THREADS",
        "OPENBLAS_NUM_THREADS",
        "OMP_WAIT_POLICY",
    )
    watching = ("distributed.worker.profile.enabled", "distributed.admin.tick.interval")
    told = {name: os.environ.get(name, "") for name in names}
    return told | {name: dask.config.get(name) for name in watching}


def test_each_worker_has_its_share_of_the_processors() -> None:
    with local_cluster(2) as address, connected(address) as client:
        told = client.run(surroundings)
    threads = str(share(2))
    assert len(told) == 2
    for each in told.values():
        print(each)
        assert each["RINGLET_THREADS"] == each["OMP_NUM_THREADS"] == each["LP_NUM_THREADS"] == threads
        assert each["OPENBLAS_NUM_THREADS"] == "1"
        assert each["OMP_WAIT_POLICY"] == "passive"
        assert each["distributed.worker.profile.enabled"] is False
        assert each["distributed.admin.tick.interval"] == "1s"
    assert [share(n) for n in (1, 10_000)] == [len(os.sched_getaffinity(0)), 1]
