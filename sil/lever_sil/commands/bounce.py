"""`lever bounce`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from .acceptance import AcceptanceCommand, Show

if TYPE_CHECKING:
    from ..acceptance.result import Figure
    from ..bounce.conditions import Condition
    from ..bounce.run_conditions import BounceResult

_DESCRIPTION = """\
Flies three helicopters in gusts, each with random pilots whose arm may close the loop of collective bounce through
lever and rotor, with the firmware in the loop: does its alarm come in time, is its gain margin right, how far does
mitigation move the limit, what does it do to the pilot's own flying, and does it do harm where the estimated arm is
wrong or a sensor fails? With five helicopters: what a fuselage that bends between accelerometer and seat, a trunk on a
cushion, delays, friction and a slow actuator leave of that (the conditions that begin with between_).

The firmware knows the aircraft by a table of its response, which is off by 5 % and 0.05 rad (standard deviations, which
it is given). "all runs" pools the flights (sum, mean, rms or worst, as `--list` and the page say); a limit applies to
that unless it says median or worst. The page of -o has a chart and all figures of each condition.

Exit status: 0 when all conditions hold, 1 when one misses, 2 when the command line is wrong.
"""
_EPILOG = """\
examples:
  lever bounce --list
  lever bounce --quick                            some conditions, three pilots an aircraft
  lever bounce --only alarm margin --seeds 50
  lever bounce -o out/bounce                      all conditions, 20 pilots an aircraft
"""


class _Bounce(AcceptanceCommand["Condition"]):
    name = "bounce"
    about = "test alarm and mitigation of collective bounce in flights"
    description, epilog = _DESCRIPTION, _EPILOG
    each = "pilots an aircraft"

    def conditions(self) -> Mapping[str, Condition]:
        from ..bounce.conditions import CONDITIONS

        return CONDITIONS

    def figures(self) -> Mapping[str, Figure]:
        from ..bounce.measure import FIGURES

        return FIGURES

    def measure(self, chosen: Sequence[Condition], seeds: int, show: Show) -> Sequence[BounceResult]:
        from ..bounce import run_conditions

        return run_conditions.run(chosen, seeds, show)

    def page(self, results: Sequence[Any], seeds: int) -> str:
        from ..bounce import bounce_page

        return bounce_page.build(results, seeds)


add_parser = _Bounce().add_parser
