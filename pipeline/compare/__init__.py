"""Are two pictures, or two folders of them, the same? Metrics, gates, golden pictures, and a page that shows the difference."""

from pipeline.compare.folders import Comparison, Pair, compare
from pipeline.compare.gates import Limits, judge
from pipeline.compare.metrics import Metrics, measure
from pipeline.compare.pictures import Picture, load_picture, renderer_of

__all__ = [
    "Comparison",
    "Limits",
    "Metrics",
    "Pair",
    "Picture",
    "compare",
    "judge",
    "load_picture",
    "measure",
    "renderer_of",
]
