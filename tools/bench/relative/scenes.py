"""The scenes of the benches: those of the tests, made by numerical integration without the product."""

import sys

from bench.rows import ROOT

sys.path.append(str(ROOT / "tests"))

from oracles import relative_following as following
from oracles import relative_pictures as pictures
from oracles import relative_scenes as scenes

__all__ = ["following", "pictures", "scenes"]
