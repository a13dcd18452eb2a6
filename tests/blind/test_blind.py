"""Every event in every mode, held against an oracle that knows the requirements and not the code."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from lever_cdkf.firmware.estimator import DO_NOT_TRUST
from numpy.typing import NDArray

from blind import oracle, promises, tables
from blind.disagreements import DISAGREEMENTS
from blind.flights import EVENTS, MODES, Event, Flight, Mode, applies, flight

Rule = Callable[[Flight], list[str]]


def cases(
    rule: Rule, events: Iterable[str] = EVENTS, when: Callable[[Event, Mode], object] | None = None
) -> list[object]:
    """Return events in every mode for a rule; where the estimator is known to break it, as a strict xfail."""
    parameters: list[object] = []
    for mode in MODES:
        for event in events:
            if not applies(EVENTS[event], mode) or (when is not None and not when(EVENTS[event], mode)):
                continue
            reason = DISAGREEMENTS.get((rule.__name__, event, mode.state, mode.torque))
            marks = [] if reason is None else [pytest.mark.xfail(strict=True, reason=reason)]
            parameters.append(pytest.param(event, mode, marks=marks, id=f"{event}-{mode.state}-{mode.torque}"))
    return parameters


def check(rule: Rule, event: str, mode: Mode) -> None:
    """Fly an event in a mode, and require that a rule has nothing to say of it."""
    said = rule(flight(event, mode))
    assert not said, "\n".join([*said[:8], f"{len(said)} in all"])


def check_all(rule: Rule, mode: Mode) -> None:
    """Fly every event in a mode, and require that a rule has nothing to say of any."""
    said = [sentence for name, event in EVENTS.items() if applies(event, mode) for sentence in rule(flight(name, mode))]
    assert not said, "\n".join([*said[:8], f"{len(said)} in all"])


def reported(event: Event, mode: Mode) -> bool:
    """Return whether something must be reported of an event in a mode."""
    return event.gap > 0 or promises.promised(event, mode) is not None


def dithers(event: Event, mode: Mode) -> bool:
    """Return whether the dither of a flight is to be looked at."""
    return mode.torque == "dither"


OUTAGES = ("outputs_missing", "gap_50ms", "gap_1s")
SPIKES = [name for name, event in EVENTS.items() if event.kind == "spike"]
ENDING = [name for name in EVENTS if name != "stiffer"]


@pytest.mark.requirement("R55")
@pytest.mark.parametrize(("event", "mode"), cases(oracle.shows))
def test_shows(event: str, mode: Mode) -> None:
    check(oracle.shows, event, mode)


@pytest.mark.requirement("R55")
@pytest.mark.parametrize(
    ("event", "mode"), cases(oracle.shows_base, ("z_ddot_sign", "z_ddot_half", "theta_half", "nothing"))
)
def test_shows_base(event: str, mode: Mode) -> None:
    check(oracle.shows_base, event, mode)


@pytest.mark.requirement("R55")
@pytest.mark.parametrize(("event", "mode"), cases(oracle.stands))
def test_stands(event: str, mode: Mode) -> None:
    check(oracle.stands, event, mode)


@pytest.mark.requirement("R56")
@pytest.mark.parametrize("mode", MODES, ids="-".join)
def test_rests(mode: Mode) -> None:
    check_all(oracle.rests, mode)


@pytest.mark.requirement("R5", "R33", "R55", "R56")
@pytest.mark.parametrize("mode", MODES, ids="-".join)
def test_holds(mode: Mode) -> None:
    check_all(oracle.holds, mode)


@pytest.mark.requirement("R13")
@pytest.mark.parametrize(("event", "mode"), cases(oracle.keeps))
def test_keeps(event: str, mode: Mode) -> None:
    check(oracle.keeps, event, mode)


@pytest.mark.requirement("R55")
@pytest.mark.parametrize("mode", MODES, ids="-".join)
def test_adapts(mode: Mode) -> None:
    check_all(oracle.adapts, mode)


@pytest.mark.requirement("R5", "R55")
@pytest.mark.parametrize("mode", MODES, ids="-".join)
def test_certain(mode: Mode) -> None:
    check_all(oracle.certain, mode)


@pytest.mark.requirement("R6", "R60")
@pytest.mark.parametrize(("event", "mode"), cases(oracle.opens, ("hands_off", "stiffer")))
def test_opens(event: str, mode: Mode) -> None:
    check(oracle.opens, event, mode)


@pytest.mark.requirement("R9", "R12", "R13")
@pytest.mark.parametrize("mode", MODES, ids="-".join)
def test_finite(mode: Mode) -> None:
    check_all(oracle.finite, mode)


@pytest.mark.requirement("R36", "R37", "R41")
@pytest.mark.parametrize("mode", MODES, ids="-".join)
def test_drives(mode: Mode) -> None:
    check_all(promises.drives, mode)


@pytest.mark.requirement("R6", "R7", "R29", "R30", "R31", "R32", "R33", "R55", "R56")
@pytest.mark.parametrize(("event", "mode"), cases(promises.reports, when=reported))
def test_reports(event: str, mode: Mode) -> None:
    check(promises.reports, event, mode)


@pytest.mark.requirement("R29")
@pytest.mark.parametrize(("event", "mode"), cases(promises.settles, OUTAGES))
def test_settles(event: str, mode: Mode) -> None:
    check(promises.settles, event, mode)


@pytest.mark.requirement("R29")
@pytest.mark.parametrize(("event", "mode"), cases(promises.settles_at_once, ("gap_50ms", "gap_1s")))
def test_settles_at_once(event: str, mode: Mode) -> None:
    check(promises.settles_at_once, event, mode)


@pytest.mark.requirement("R33")
@pytest.mark.parametrize(("event", "mode"), cases(promises.jumps, ("theta_offset",)))
def test_jumps(event: str, mode: Mode) -> None:
    check(promises.jumps, event, mode)


@pytest.mark.requirement("R41")
@pytest.mark.parametrize(("event", "mode"), cases(promises.permits, when=dithers))
def test_permits(event: str, mode: Mode) -> None:
    check(promises.permits, event, mode)


@pytest.mark.requirement("R31", "R34")
@pytest.mark.parametrize(("event", "mode"), cases(promises.spikes, SPIKES))
def test_spikes(event: str, mode: Mode) -> None:
    check(promises.spikes, event, mode)


@pytest.mark.requirement("R30")
@pytest.mark.parametrize(("event", "mode"), cases(promises.ignores, ("clock_stands",)))
def test_ignores(event: str, mode: Mode) -> None:
    check(promises.ignores, event, mode)


@pytest.mark.requirement("R6", "R58")
@pytest.mark.parametrize(("event", "mode"), cases(promises.changed, ("nothing", "stiffer")))
def test_changed(event: str, mode: Mode) -> None:
    check(promises.changed, event, mode)


@pytest.mark.requirement("R35", "R55")
@pytest.mark.parametrize(("event", "mode"), cases(promises.back, ENDING))
def test_back(event: str, mode: Mode) -> None:
    check(promises.back, event, mode)


@pytest.mark.requirement("R5", "R35", "R55")
@pytest.mark.parametrize(("event", "mode"), cases(promises.learns))
def test_learns(event: str, mode: Mode) -> None:
    check(promises.learns, event, mode)


@pytest.mark.requirement("R8", "R55")
@pytest.mark.parametrize(("event", "mode"), cases(promises.truthful, promises.RIGHT))
def test_truthful(event: str, mode: Mode) -> None:
    check(promises.truthful, event, mode)


@pytest.mark.requirement("R57")
def test_what_says_not_to_trust() -> None:
    assert tables.DO_NOT_TRUST == DO_NOT_TRUST


# --- the rules themselves --------------------------------------------------------------------------------------------


def doctored(event: str, mode: Mode, **columns: Callable[[Flight], object]) -> Flight:
    """Return a flight of which some columns are replaced."""
    flown = flight(event, mode)
    values: dict[str, Any] = {name: column(flown) for name, column in columns.items()}
    return replace(flown, **values)


def estimate_with(name: str, change: Callable[[NDArray[Any]], NDArray[Any]]) -> Callable[[Flight], NDArray[Any]]:
    """Return a column of estimates that are others in the last quarter of a flight."""

    def column(flown: Flight) -> NDArray[Any]:
        estimate = flown.estimate.copy()
        last = 3 * len(estimate) // 4
        estimate[name][last:] = change(estimate[name][last:])
        return estimate

    return column


def rising(flown: Flight) -> NDArray[np.float32]:
    """Return test ratios of which that of colour rises all the time."""
    ratios = flown.ratios.copy()
    ratios[:, tables.INDEX["colour"]] = np.linspace(0.0, 0.9, len(ratios))
    return ratios


def rested_for(samples: int) -> Callable[[Flight], NDArray[Any]]:
    """Return faults with a rest of so many samples more, late in a flight."""

    def column(flown: Flight) -> NDArray[Any]:
        faults = flown.faults.copy()
        late = 3 * len(faults) // 4
        faults[late : late + samples] |= tables.EXCITATION
        return faults

    return column


RUN, FROZEN = Mode("run", "dither"), Mode("frozen", "dither")
DOCTORED: list[tuple[Rule, str, Mode, dict[str, Callable[[Flight], object]]]] = [
    (oracle.shows, "theta_stuck", RUN, {"faults": lambda flown: np.zeros_like(flown.faults)}),
    (oracle.shows, "nothing", FROZEN, {"faults": lambda flown: flown.faults | tables.HANDS_OFF}),
    (oracle.stands, "hands_off", FROZEN, {"verdict": lambda flown: np.full_like(flown.verdict, 10)}),
    (oracle.stands, "nothing", RUN, {"verdict": lambda flown: np.full_like(flown.verdict, 7)}),
    (oracle.rests, "nothing", RUN, {"faults": rested_for(200)}),
    (oracle.holds, "nothing", FROZEN, {"estimate": estimate_with("parameter", lambda old: 1.01 * old)}),
    (oracle.holds, "theta_stuck", RUN, {"verdict": lambda flown: np.full_like(flown.verdict, 6)}),
    (oracle.certain, "nothing", FROZEN, {"estimate": estimate_with("parameter_sigma", lambda old: 0.9 * old)}),
    (oracle.certain, "nothing", FROZEN, {"estimate": estimate_with("parameter_sigma", lambda old: 1.1 * old)}),
    (oracle.adapts, "theta_stuck", RUN, {"ratios": rising, "verdict": lambda flown: np.full_like(flown.verdict, 2)}),
    (oracle.opens, "hands_off", RUN, {"estimate": estimate_with("parameter_sigma", lambda old: 0.1 * old)}),
    (oracle.finite, "nothing", RUN, {"estimate": estimate_with("theta", lambda old: np.nan * old)}),
    (oracle.finite, "nothing", RUN, {"recoveries": lambda flown: 1}),
    (oracle.finite, "nothing", RUN, {"estimate": estimate_with("parameter", lambda old: 0.0 * old)}),
    (promises.drives, "tau_m_sign", RUN, {"torque": lambda flown: np.full_like(flown.torque, 0.3)}),
    (promises.drives, "outputs_missing", RUN, {"torque": lambda flown: np.full_like(flown.torque, 0.3)}),
    (promises.drives, "nothing", RUN, {"torque": lambda flown: np.zeros_like(flown.torque)}),
    (promises.reports, "theta_missing", FROZEN, {"faults": lambda flown: np.zeros_like(flown.faults)}),
    (promises.settles, "gap_50ms", RUN, {"faults": lambda flown: np.zeros_like(flown.faults)}),
    (promises.ignores, "clock_stands", RUN, {"faults": lambda flown: np.zeros_like(flown.faults)}),
    (promises.truthful, "nothing", RUN, {"faults": lambda flown: flown.faults | tables.THETA}),
    (promises.back, "nothing", RUN, {"modes": lambda flown: np.full_like(flown.modes, tables.COAST)}),
    (promises.learns, "nothing", FROZEN, {"estimate": lambda flown: flight("nothing", RUN).estimate}),
]


@pytest.mark.requirement("R55")
@pytest.mark.parametrize(("rule", "event", "mode", "columns"), DOCTORED)
def test_rules_notice(rule: Rule, event: str, mode: Mode, columns: dict[str, Callable[[Flight], object]]) -> None:
    assert rule(doctored(event, mode, **columns)), f"{rule.__name__} has nothing to say of {event} with other {columns}"
