"""How fast strands are expanded from guides: a full head of hair in a swing, pushed out of a round head."""

import resource
import time

import numpy as np
from numpy.typing import NDArray

from pipeline import kernels
from pipeline.bench.interpolate_scene import bound_strands, round_groom, swung
from pipeline.strands.expand import Expansion, Style

_GROOM = 20_000
_GUIDES = 1_000
_CHUNK = 16_384
_REPEATS = 5
