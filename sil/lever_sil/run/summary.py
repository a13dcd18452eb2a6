"""What a run comes to: summary.json, and the verdict in words.

Errors are relative to the truth at the same sample and judged only from `converged_after` seconds after the start and
after each jump of the truth on; how long the estimates need until then is what the times to 10 % and 5 % tell.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from lever_cdkf.firmware.native import enum_names
from lever_cdkf.firmware.quantities import DYNAMICS, LEAST_COVERAGE, Quantity
from lever_cdkf.numeric.arrays import BoolArray, FloatArray
from lever_cdkf.results import bounce, nis, summary, trust, whiteness
from lever_cdkf.results.faults import FaultCounts
from lever_cdkf.results.nis import Innovations, Nis, freedom
from lever_cdkf.results.ratios import behind_calibration
from lever_cdkf.results.summary import (
    Estimator,
    Firmware,
    Quality,
    SimulationSummary,
    Stability,
    TrueTransfer,
    Truth,
)
from lever_cdkf.results.trace import Trace
from lever_cdkf.results.whiteness import Whiteness
from lever_cdkf.text.counts import in_percent

from .. import measures
from ..scenarios.scenario import Scenario
from .loop import Recording

MOST_TRANSFERS = 50
"""How often, spread over the run, the transfer function of a truth is looked at for changes."""


def build(recording: Recording, trace: Trace) -> SimulationSummary:
    """Return the content of summary.json, but for the wall times."""
    scenario = recording.scenario
    quality = {quantity.key: _quality(quantity, scenario, trace) for quantity in scenario.judged()}
    count = len(recording.inputs.time)
    modes = _modes(trace)
    fault_shares, flagged_share = _faults(scenario, trace)
    missed = missed_limits(
        scenario.limits,
        {name: entry.rms_percent for name, entry in quality.items()},
        {name: entry.coverage_2sigma for name, entry in quality.items()},
    )
    summary = SimulationSummary(
        estimator=Estimator(**scenario.config.choices, settings=dict(scenario.config.settings)),
        samples=count,
        lost=_last(trace["lost"]),
        corrupt=_last(trace["corrupt"]),
        late=_last(trace["late"]),
        restarts=_last(trace["restarts"]),
        nis=_nis(scenario, trace),
        whiteness=_whiteness(scenario, trace),
        stability=_stability(scenario, trace),
        modes_s=modes,
        passed=not (missed or recording.unanswered or recording.misplaced or "fault" in modes),
        verdict="",
        scenario=_scenario(scenario),
        truth=_truth(recording),
        firmware=_firmware(recording),
        parameters=quality,
        unanswered=recording.unanswered,
        misplaced=recording.misplaced,
        fault_shares=fault_shares,
        flagged_share=flagged_share,
        missed=missed,
        simulated_time_s=count * scenario.period,
    )
    evidence = behind_calibration(trace, judged_samples(scenario, trace["time_s"]))
    summary = replace(summary, warning=trust.warning(fault_shares, flagged_share, evidence))
    return replace(summary, verdict=" ".join(filter(None, (summary.warning, _verdict(summary)))))


def _scenario(scenario: Scenario) -> summary.Scenario:
    return summary.Scenario(
        name=scenario.name,
        title=scenario.title,
        description=scenario.description,
        seed=scenario.seed,
        sample_period_s=scenario.period,
        converged_after_s=scenario.converged_after,
        changes_s=list(scenario.changes()),
        limits=dict(scenario.limits or {}),
    )


def _truth(recording: Recording) -> Truth:
    scenario, inputs = recording.scenario, recording.inputs
    if scenario.pilot.model == scenario.config.choices["model"]:
        return Truth(scenario.pilot.model)
    at = np.linspace(0, len(inputs.time) - 1, MOST_TRANSFERS).astype(np.intp)
    transfer = inputs.truth.transfer(at)
    rows = np.hstack((transfer.numerator, transfer.denominator))
    new = np.flatnonzero(np.append(True, np.any(np.diff(rows, axis=0) != 0.0, axis=1)))
    polynomials = TrueTransfer(
        time_s=inputs.time[at[new]].tolist(),
        numerator=transfer.numerator[new].tolist(),
        denominator=transfer.denominator[new].tolist(),
    )
    return Truth(scenario.pilot.model, scenario.pilot.about, scenario.pilot.about_dynamics, polynomials)


def _firmware(recording: Recording) -> Firmware:
    identity, scenario = recording.identity, recording.scenario
    same = None if identity.settings_crc is None else identity.settings_crc == scenario.config.settings_crc
    return Firmware(
        identity.version, identity.contract, same, True if recording.has_aircraft or not scenario.aircraft else None
    )


def _quality(quantity: Quantity, scenario: Scenario, trace: Trace) -> Quality:
    truth = trace[quantity.column("true")]
    error = trace[quantity.column("estimate")] - truth
    relative, sigma = error / truth, trace[quantity.column("sigma")]
    judged = judged_samples(scenario, trace["time_s"]) & np.isfinite(relative)
    reached = [times_to(relative, trace["time_s"], scenario.changes(), within) for within in (0.1, 0.05)]
    if not judged.any():
        return Quality(None, None, None, *reached)
    return Quality(
        rms_percent=100.0 * float(measures.rms(relative[judged])),
        bias_percent=100.0 * float(np.mean(relative[judged])),
        coverage_2sigma=float(measures.covered(error[judged], sigma[judged])),
        time_to_10_percent_s=reached[0],
        time_to_5_percent_s=reached[1],
    )


def judged_samples(scenario: Scenario, time: FloatArray) -> BoolArray:
    """Return True from `converged_after` seconds after each change on, until the next one."""
    judged = np.ones(len(time), dtype=np.bool_)
    for change in scenario.changes():
        judged &= ~((time >= change) & (time < change + scenario.converged_after))
    return judged


def times_to(relative: FloatArray, time: FloatArray, changes: tuple[float, ...], within: float) -> list[float | None]:
    """After each change, the time [s] until |relative| stays <= within up to the next change; None if it never does.

    A sample without an estimate (NaN) counts as outside.
    """
    times: list[float | None] = []
    for begin, end in zip(changes, (*changes[1:], math.inf), strict=True):
        part = (time >= begin) & (time < end)
        settled = float(measures.settling_times(relative[np.newaxis, part], time[part] - begin, within)[0])
        times.append(None if math.isnan(settled) else round(settled, 9))
    return times


def _nis(scenario: Scenario, trace: Trace) -> Nis:
    """Return the nis of the judged samples."""
    outputs = freedom(trace["theta_measured_rad"], trace["theta_dot_measured_rad_s"])
    judged = judged_samples(scenario, trace["time_s"])
    innovations = Innovations()
    innovations.add(trace["nis"][judged], outputs[judged])
    return innovations.figures()


def _whiteness(scenario: Scenario, trace: Trace) -> Whiteness | None:
    """Return the whiteness of the judged samples; None where there are too few."""
    residual = whiteness.residual(trace)
    if residual is None:
        return None
    judged = np.where(judged_samples(scenario, trace["time_s"]), residual, np.nan)
    return whiteness.measure(judged, scenario.period)


def _stability(scenario: Scenario, trace: Trace) -> Stability | None:
    """None without an aircraft."""
    if scenario.known_aircraft is None:
        return None
    gathered = bounce.Bounce(scenario.period)
    gathered.add(trace)
    return gathered.summary(scenario.known_aircraft)


def _last(column: FloatArray) -> int:
    finite = column[np.isfinite(column)]
    return int(finite[-1]) if len(finite) else 0


def _modes(trace: Trace) -> dict[str, float]:
    """Return seconds spent in each mode, by name, as far as HEALTH told."""
    mode, step = trace["mode"], float(trace["time_s"][1] - trace["time_s"][0])
    samples = {name: int(np.sum(mode == number)) for number, name in enum_names("lever_mode").items()}
    return {name: round(count * step, 9) for name, count in samples.items() if count}


def _faults(scenario: Scenario, trace: Trace) -> tuple[dict[str, float], float | None]:
    """Return shares (0 to 1) of the judged time with each fault that there was, and with any of DO_NOT_TRUST.

    None: unknown.
    """
    column = trace["faults"][judged_samples(scenario, trace["time_s"])]
    counts = FaultCounts()
    counts.add(column)
    return counts.shares, counts.warned_share


def missed_limits(
    limits: Mapping[str, float] | None, rms_percent: Mapping[str, float | None], coverage: Mapping[str, float | None]
) -> list[str]:
    """Return the limits of a scenario that were not kept, in words; None is not judged."""
    missed = []
    limits = limits or {}
    for name, rms in rms_percent.items():
        limit = limits.get(name)
        if limit is not None and rms is not None and rms > 100.0 * limit:
            missed.append(f"rms error of {name} {_above(rms, 100.0 * limit)} % (limit {100.0 * limit:g} %)")
    least = limits.get("coverage")
    for name, share in coverage.items():
        if least is not None and share is not None and share < least:
            missed.append(f"coverage of {name} {in_percent(share):g} % (limit {100.0 * least:g} %)")
    return missed


def _above(value: float, limit: float) -> str:
    """With as many decimals as it takes to differ from the limit."""
    texts = (f"{value:.{decimals}f}" for decimals in range(1, 12))
    return next((text for text in texts if float(text) > limit), f"{value!r}")


def _verdict(summary: SimulationSummary) -> str:
    """Return the run in a few sentences, for a reader who does not know Kalman filters."""
    return " ".join(
        sentence
        for sentence in (
            _verdict_run(summary),
            _verdict_truth(summary),
            _verdict_limits(summary),
            _verdict_sigma(summary.parameters),
            nis.verdict(summary.nis),
            whiteness.verdict(summary.whiteness),
            bounce.verdict(summary.stability),
            _verdict_settings(summary),
            _verdict_aircraft(summary),
        )
        if sentence
    )


def _verdict_run(summary: SimulationSummary) -> str:
    troubles = []
    if summary.unanswered:
        troubles.append(f"{summary.unanswered} samples got no answer")
    if summary.misplaced:
        troubles.append(f"{summary.misplaced} estimates belong to other samples")
    if "fault" in summary.modes_s:
        troubles.append(f"the estimator was in fault for {summary.modes_s['fault']:g} s")
    return f"Trouble: {' and '.join(troubles)}." if troubles else ""


def _verdict_settings(summary: SimulationSummary) -> str:
    """Refuse a run on other settings; one of less than a second may not learn which they are."""
    if summary.firmware.settings_as_scenario is not None:
        return ""
    return "The estimator has not sent its settings (IDENTITY): those of the scenario are assumed."


def _verdict_aircraft(summary: SimulationSummary) -> str:
    """No frame tells which one an estimator watches."""
    if summary.firmware.aircraft_as_scenario:
        return ""
    return "Which aircraft the estimator on the bus watches is not known: it should be that of the scenario."


def _verdict_truth(summary: SimulationSummary) -> str:
    if summary.truth.model == summary.estimator.model:
        return ""
    return (
        f"The pilot ({summary.truth.model}) is not of the estimator's model ({summary.estimator.model}): "
        "only natural frequency and damping ratio can be compared with the truth."
    )


def kept_limits(*summaries: SimulationSummary) -> str:
    """Say that the limits of the scenario are kept; they are the estimate's alone where the loop was unstable."""
    unstable = any(each.stability is not None and each.stability.unstable_s for each in summaries)
    return "The estimate keeps its limits, in a loop that was unstable." if unstable else "All limits kept."


def _verdict_limits(summary: SimulationSummary) -> str:
    errors = ", ".join(
        f"{_spelled(name)} {entry.rms_percent:.1f} %"
        for name, entry in summary.parameters.items()
        if entry.rms_percent is not None
    )
    if not errors:
        return "Too short to judge: the run ends before converged_after."
    if summary.missed:
        return f"Limits missed: {'; '.join(summary.missed)}. Rms errors after convergence: {errors}."
    kept = f"{kept_limits(summary)} " if summary.scenario.limits else ""
    return f"{kept}Rms errors after convergence: {errors}."


def _verdict_sigma(quality: dict[str, Quality]) -> str:
    covered = {name: entry.coverage_2sigma for name, entry in quality.items() if entry.coverage_2sigma is not None}
    if not covered:
        return ""
    worst = min(covered, key=lambda name: covered[name])
    percent = f"{in_percent(covered[worst]):g} % of the time"
    if covered[worst] >= LEAST_COVERAGE:
        return f"In this run ±2σ covers every truth for at least {percent}."
    return f"In this run the stated σ of {_spelled(worst)} is too small: ±2σ covers the truth for {percent}."


def _spelled(name: str) -> str:
    """Return a quantity as it stands in a sentence; symbols stay."""
    return {quantity.key: quantity.name for quantity in DYNAMICS}.get(name, name)
