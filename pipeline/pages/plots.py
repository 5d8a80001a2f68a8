"""Line plots as SVG inside a page: no library, no script; colours come from the page's style, light or dark.

Marks at round numbers after Heckbert, "Nice Numbers for Graph Labels", Graphics Gems (1990).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from pipeline.pages.markup import Html, tag

WIDTH, HEIGHT = 560, 220  # [px] of the drawing; it scales with the page
_LEFT, _RIGHT, _TOP, _BOTTOM = 52, 26, 8, 34
_MOST = 600  # points of a line that are drawn


@dataclass(frozen=True)
class Line:
    """One curve: its name in the legend and (N,) values; what is not finite breaks the curve."""

    name: str
    values: Sequence[float]
    dashed: bool = False


def plot(lines: Sequence[Line], x: Sequence[float], x_label: str, title: str) -> Html:
    """Draw curves over (N,) abscissae under a title that names their unit; a legend stands below."""
    finite = [value for line in lines for value in line.values if math.isfinite(value)]
    y_marks = marks(min(finite, default=0.0), max(finite, default=1.0))
    x_marks = marks(min(x, default=0.0), max(x, default=1.0), tight=True)
    across, up = (
        _scale(x_marks[0], x_marks[-1], _LEFT, WIDTH - _RIGHT),
        _scale(y_marks[0], y_marks[-1], HEIGHT - _BOTTOM, _TOP),
    )
    shown = _inner_marks(x_marks)
    grid = [
        *(tag("line", x1=_LEFT, x2=WIDTH - _RIGHT, y1=up(y), y2=up(y)) for y in y_marks),
        *(
            tag("text", number(y), x=_LEFT - 6, y=f"{float(up(y)) + 4:.1f}", text_anchor="end")
            for y in y_marks
        ),
        *(
            tag("text", number(at), x=across(at), y=HEIGHT - _BOTTOM + 16, text_anchor="middle")
            for at in shown
        ),
        tag("text", x_label, x=(_LEFT + WIDTH - _RIGHT) / 2, y=HEIGHT - 3, text_anchor="middle"),
    ]
    curves = [
        tag(
            "path",
            d=_path(x, line.values, across, up),
            class_=f"line c{index % 6}{' dashed' if line.dashed else ''}",
        )
        for index, line in enumerate(lines)
    ]
    drawing = tag(
        "svg", tag("title", title), *grid, *curves, viewBox=f"0 0 {WIDTH} {HEIGHT}", role="img", class_="plot"
    )
    names = [tag("li", tag("i", class_=f"c{index % 6}"), line.name) for index, line in enumerate(lines)]
    return tag("figure", tag("figcaption", title), drawing, tag("ul", *names, class_="legend"), class_="plot")


def marks(low: float, high: float, tight: bool = False) -> list[float]:
    """Round numbers, about five, around low..high; `tight` keeps the two ends as they are."""
    if not high > low:
        low, high = min(low, 0.0), max(high, 0.0) if high != low or high else 1.0
        high = high if high > low else low + 1
    raw = (high - low) / 4
    power = 10.0 ** math.floor(math.log10(raw))
    step = next(nice * power for nice in (1, 2, 2.5, 5, 10) if nice * power >= raw * (1 - 1e-9))
    first, last = math.floor(low / step + 1e-9), math.ceil(high / step - 1e-9)
    inside = [round(index * step, 12) for index in range(first, last + 1)]
    if not tight:
        return inside
    return [low, *(value for value in inside if low < value < high), high]


def number(value: float) -> str:
    """A short number for an axis or a table."""
    if value and not 1e-3 <= abs(value) < 1e5:
        mantissa, _, exponent = f"{value:.2e}".partition("e")
        return f"{float(mantissa):g}e{int(exponent)}"
    return f"{value:.4g}"


def _inner_marks(x_marks: Sequence[float]) -> list[float]:
    """The ends, and the round numbers that keep clear of them."""
    low, high = x_marks[0], x_marks[-1]
    gap = 0.08 * (high - low)
    return [low, *(value for value in x_marks[1:-1] if low + gap < value < high - gap), high]


def _scale(low: float, high: float, start: float, end: float) -> "_Scale":
    return _Scale(low, (end - start) / ((high - low) or 1.0), start)


@dataclass(frozen=True)
class _Scale:
    low: float
    factor: float
    start: float

    def __call__(self, value: float) -> str:
        return f"{self.start + (value - self.low) * self.factor:.1f}"


def _path(x: Sequence[float], values: Sequence[float], across: _Scale, up: _Scale) -> str:
    """Moves and lines; of long curves every n-th point, the largest within each n."""
    stride = max(1, -(-len(values) // _MOST))
    parts: list[str] = []
    pen = "M"
    for first in range(0, len(values), stride):
        index = max(
            range(first, min(first + stride, len(values))),
            key=lambda i: (math.isfinite(values[i]), abs(values[i])),
        )
        if math.isfinite(values[index]):
            parts.append(f"{pen}{across(x[index])} {up(values[index])}")
            pen = "L"
        else:
            pen = "M"
    return "".join(parts)
