"""Are two pictures, or two folders of them, the same? Metrics, gates and a page that shows the difference."""

from pipeline.compare.folders import Comparison, Pair, compare
from pipeline.compare.gates import Limits, judge
from pipeline.compare.metrics import Metrics, measure

__all__ = ["Comparison", "Limits", "Metrics", "Pair", "compare", "judge", "measure"]
