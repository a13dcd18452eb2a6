"""The closed loop of a scenario in C: plant, sensors and firmware, some thousand times faster than real time.

`run()` gives what campaigns need of a run, at a stride; run/runner.py the whole of it, with every frame.
"""

from .closed_loop import FastRun, run
from .plants import has

__all__ = ["FastRun", "has", "run"]
