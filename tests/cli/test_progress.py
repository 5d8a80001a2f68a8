"""Progress off a terminal: plain lines with what is done, how fast, and what is left."""

import re

import pytest

from pipeline import progress


def test_a_heartbeat_tells_rate_and_time_left(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(progress, "HEARTBEAT_S", 0.0)
    with progress.track("simulate", total=3) as bar:
        for _ in range(3):
            bar.advance()
    out, err = capsys.readouterr()
    assert out == ""
    first, second, last = err.splitlines()
    assert re.fullmatch(r"simulate: frame 1/3, \S+ frames/s, \S+ s left", first)
    assert second.startswith("simulate: frame 2/3")
    assert re.fullmatch(r"simulate: 3 frames in \S+ s", last)


def test_between_heartbeats_nothing_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    with progress.track("groom", total=1000, unit="strand") as bar:
        for _ in range(1000):
            bar.advance()
    assert len(capsys.readouterr().err.splitlines()) == 1


def test_what_fails_claims_no_success(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(RuntimeError, match="broken"), progress.track("render", total=2):
        raise RuntimeError("broken")
    assert capsys.readouterr().err == ""
