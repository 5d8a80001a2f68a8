"""The bench of rendering: frames as the stage makes them, the same for any number of threads and any chunk."""

import pytest

from pipeline import kernels
from pipeline.bench import render_table
from pipeline.bench.render import bench
from pipeline.render import chunks


def test_the_bench_draws_the_same_frame_however_it_is_made() -> None:
    settled = chunks.CHUNK
    found = [
        bench(700, 12, (96, 64), frames=1, threads=threads, chunk=chunk)
        for threads, chunk in ((2, 700), (1, 700), (2, 90))
    ]
    kernels.set_threads(2)
    print(found[0])
    assert len({figures["picture"] for figures in found}) == 1
    assert found[0]["geometry"] == "coverage"
    assert {"expand", "shadows", "light", "sort", "draw", "opengl", "develop", "png"} == set(
        found[0]["parts"]
    )
    assert all(value >= 0 for value in found[0]["parts"].values())
    assert settled == chunks.CHUNK


def test_the_table_finds_growth_and_pictures_that_differ(monkeypatch: pytest.MonkeyPatch) -> None:
    def known(what: str, *options: object) -> render_table.Row:
        strands = int(str(options[1]))
        broken = "--threads" in options and strands == 30_000
        return render_table.Row(what, 1e-6 * strands**0.8, 0.5, "other" if broken else str(strands))

    monkeypatch.setattr(render_table, "_row", known)
    right, wrong = render_table.table(None, 100_000), render_table.table(None, 30_000)
    assert right["exponent"] == pytest.approx(0.8)
    assert right["equal"]
    assert not wrong["equal"]
    assert [row["what"] for row in right["rows"]][:2] == ["10,000 strands", "30,000 strands"]
