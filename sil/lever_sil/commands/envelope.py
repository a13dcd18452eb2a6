"""`lever envelope`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from .acceptance import AcceptanceCommand, Show

if TYPE_CHECKING:
    from ..acceptance.result import Figure
    from ..envelope.condition import Condition
    from ..envelope.run_conditions import EnvelopeResult

_DESCRIPTION = """\
Runs the firmware in the conditions that a collective meets: a pilot who moves the lever, lets go or tightens the grip,
unknown torque, rest, sensors that fail or are off, friction, pilots that no model can represent. Levers and pilots are
simulated by a plant that shares nothing with the filter's model; samples go straight into the firmware, with its
default settings.

A condition holds when the natural frequency (f_n), damping ratio (zeta) and parameters are right within the limit, when
the stated ±2σ covers the truth as often as the limit asks, or, where the limit says so, when the firmware flags that
it is not to be trusted. "all runs" pools them (rms of errors, mean of shares, the longest time); a limit
applies to that unless it says median, p90 (nine of ten runs are no worse) or worst. The page of -o has a chart and
all figures of each condition.

The second table of --list, "rules", measures what the firmware takes for a change of the pilot, a fault or rough air,
and how soon. Its limits are aims, and some are missed. It runs only where --only names it.

Exit status: 0 when all conditions hold, 1 when one misses, 2 when the command line is wrong.
"""
_EPILOG = """\
examples:
  lever envelope --list
  lever envelope --quick                          some conditions, three pilots each: ten seconds
  lever envelope --only retrim base_stuck --seeds 50
  lever envelope -o out/envelope                  all conditions, 20 pilots each: a minute on two cores
  lever envelope --only rules --seeds 40          when changes, faults and rough air are noticed: some minutes
"""


class _Envelope(AcceptanceCommand["Condition"]):
    name = "envelope"
    about = "test the firmware in the conditions of a real collective"
    description, epilog = _DESCRIPTION, _EPILOG
    each = "pilots"

    def conditions(self) -> Mapping[str, Condition]:
        from ..envelope.conditions import CONDITIONS

        return CONDITIONS

    def groups(self) -> Mapping[str, Mapping[str, Condition]]:
        from ..envelope.rules import RULES

        return {"rules": RULES}

    def figures(self) -> Mapping[str, Figure]:
        from ..envelope.measure import FIGURES

        return FIGURES

    def measure(self, chosen: Sequence[Condition], seeds: int, show: Show) -> Sequence[EnvelopeResult]:
        from ..envelope import run_conditions

        return run_conditions.run(chosen, self.conditions(), seeds, show)

    def page(self, results: Sequence[Any], seeds: int) -> str:
        from ..envelope import envelope_page

        return envelope_page.build(results, seeds)


add_parser = _Envelope().add_parser
