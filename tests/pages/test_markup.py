"""Nothing that is not markup gets into a page unescaped, and plots show what they were given."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.pages import Html, Line, document, join, plot, table, tag
from pipeline.pages.plots import marks, number

HOSTILE = "<script>alert('&\"')</script>"


def test_children_and_attributes_are_escaped_once() -> None:
    inner = tag("b", HOSTILE, title=HOSTILE)
    assert inner == tag("b", Html(inner[len("<b") :].partition(">")[2].removesuffix("</b>")), title=HOSTILE)
    assert tag("p", inner) == f"<p>{inner}</p>"
    for text in (inner, join([HOSTILE]), table([HOSTILE], [[HOSTILE]])):
        assert "<script" not in text
        assert "'" not in text


@given(st.text(alphabet=st.characters(codec=None), max_size=40))
def test_any_text_makes_a_page_that_can_be_written(text: str) -> None:
    page = document(text, [tag("p", text, title=text)])
    page.encode("utf-8")
    assert len(re.findall(r"<p ", page)) == 1
    assert not re.search(r"[\x00-\x08\x0b-\x1f\x7f]", page)


def test_attributes_without_value_and_void_elements() -> None:
    assert (
        tag("input", disabled=True, hidden=False, max=None, class_="a", data_at=3)
        == '<input disabled class="a" data-at="3">'
    )


@pytest.mark.parametrize(
    ("low", "high"),
    [(0, 1), (-3.2e-7, 1e-6), (5, 5), (0, 0), (-2, -2), (1e9, 1.0001e9), (-1, 1e-30), (0.97, 1.03)],
)
def test_marks_enclose_the_values_at_round_numbers(low: float, high: float) -> None:
    found = marks(low, high)
    print(low, high, found)
    assert found[0] <= low + 1e-9 * (high - low)
    assert found[-1] >= high - 1e-9 * (high - low)
    assert 2 <= len(found) <= 12
    assert sorted(set(found)) == found


def test_a_line_goes_through_its_values_and_breaks_where_there_are_none() -> None:
    drawing = plot([Line("<a>", [0.0, 1.0, float("nan"), 1.0, 0.0])], [0, 1, 2, 3, 4], "s", "<t>")
    assert "&lt;a&gt;" in drawing
    path = re.search(r' d="([^"]+)"', drawing)
    assert path is not None
    strokes = [[tuple(map(float, p.split())) for p in s.split("L")] for s in path[1].split("M")[1:]]
    assert [len(stroke) for stroke in strokes] == [2, 2]
    (first, second), (third, fourth) = strokes
    assert first[1] == fourth[1] > second[1] == third[1]  # zero is below one: y grows downwards
    assert second[0] - first[0] == pytest.approx(fourth[0] - third[0], abs=0.2)


def test_long_lines_keep_their_peaks() -> None:
    values = [0.0] * 100_000
    values[70_001] = 1.0
    drawing = plot([Line("a", values)], range(len(values)), "s", "t")
    path = re.search(r' d="([^"]+)"', drawing)
    assert path is not None
    heights = [float(point.split()[1]) for point in re.split("[ML]", path[1])[1:]]
    assert len(heights) <= 600
    assert min(heights) < max(heights)


def test_nothing_to_plot_is_no_error() -> None:
    assert "<svg" in plot([Line("a", [])], [], "s", "t")
    assert "<svg" in plot([Line("a", [float("inf")])], [0.0], "s", "t")


def test_numbers_are_short() -> None:
    assert [number(v) for v in (0, 1, 0.5, 1234567, 1e-9, -2.5e-5, 0.001)] == [
        "0",
        "1",
        "0.5",
        "1.23e6",
        "1e-9",
        "-2.5e-5",
        "0.001",
    ]
