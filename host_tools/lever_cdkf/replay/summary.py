"""What a replay comes to: the figures of all samples, and a verdict in words. There is no truth to judge by."""

from __future__ import annotations

from collections import Counter

import numpy as np

from ..can.estimator_frames import why_refused
from ..can.logs import incomplete
from ..firmware.native import Config, enum_names
from ..firmware.quantities import quantities
from ..firmware.sample_clock import is_other_period
from ..results import bounce, nis, ratios, trust, whiteness
from ..results.bounce import Bounce
from ..results.faults import OPTIONAL, FaultCounts
from ..results.nis import Innovations, Nis, freedom
from ..results.summary import Estimate, Mapped, RecordingSummary, ReplaySummary
from ..results.trace import CONVERGED_AFTER, MEASURED, Trace
from ..results.whiteness import Whiteness
from ..text.counts import in_percent, rounded_down
from . import proof
from .reduction import Groups


class Figures:
    """Sums over the samples as they come."""

    def __init__(self, config: Config, model: str) -> None:
        self._period = config.settings["sample_period"]
        self._quantities = quantities(model)
        self._innovations = Innovations()
        size = whiteness.average_size(self._period)
        self._residuals = Groups(size, lambda values: (whiteness.averages(values, size),))
        self._average_s = size * self._period
        self._modes: dict[int, int] = {}
        self.bounce = Bounce(self._period)
        self.faults, self._early = FaultCounts(), FaultCounts()
        self.evidence: Counter[str] | None = None
        """The samples with each evidence behind CALIBRATION; None where test ratios are not known."""
        self._measured: set[str] = set()
        self._last: dict[str, float] = {}
        self._extremes: dict[str, tuple[float, float]] = {}

    def add(self, trace: Trace) -> None:
        """Further samples."""
        judged = trace["time_s"] >= CONVERGED_AFTER
        outputs = freedom(trace["theta_measured_rad"], trace["theta_dot_measured_rad_s"])
        self._innovations.add(trace["nis"][judged], outputs[judged])
        residual = whiteness.residual(trace)
        assert residual is not None
        self._residuals.add(np.where(judged, residual, np.nan))
        self.bounce.add(trace)
        modes, counts = np.unique(trace["mode"][np.isfinite(trace["mode"])], return_counts=True)
        for mode, count in zip(modes.tolist(), counts.tolist(), strict=True):
            self._modes[int(mode)] = self._modes.get(int(mode), 0) + count
        columns = {key: column for column, _, key in MEASURED}
        self._measured |= {fault for fault, key in OPTIONAL.items() if np.isfinite(trace[columns[key]]).any()}
        without = tuple(OPTIONAL.keys() - self._measured)
        self.faults.add(trace["faults"][judged], without)
        self._early.add(trace["faults"][~judged], without)
        if (evidence := ratios.behind_calibration(trace, judged)) is not None:
            self.evidence = (self.evidence or Counter()) + evidence
        for name in (each.column(kind) for each in self._quantities for kind in ("estimate", "sigma")):
            finite = trace[name][np.isfinite(trace[name])]
            if len(finite):
                self._last[name] = float(finite[-1])
                least, greatest = self._extremes.get(name, (np.inf, -np.inf))
                self._extremes[name] = min(least, float(finite.min())), max(greatest, float(finite.max()))

    def estimates(self) -> dict[str, Estimate]:
        """Return the last estimate of each quantity with its standard deviation, and between what it was."""
        by_key = {}
        for each in self._quantities:
            least, greatest = self._extremes.get(each.column("estimate"), (None, None))
            by_key[each.key] = Estimate(
                unit=each.unit,
                last=self._last.get(each.column("estimate")),
                last_sigma=self._last.get(each.column("sigma")),
                least=least,
                greatest=greatest,
            )
        return by_key

    def fault_shares(self) -> dict[str, float]:
        """Return the shares of the judged time with each fault; of all time where none is judged."""
        return self.faults.shares if self.faults.samples else self._early.shares

    def modes_s(self) -> dict[str, float]:
        """Return seconds in each mode."""
        names = enum_names("lever_mode")
        return {names[mode]: round(count * self._period, 9) for mode, count in sorted(self._modes.items())}

    def whiteness(self) -> Whiteness | None:
        """Return the whiteness of the residuals; None where there are too few."""
        residuals = self._residuals.all()
        return None if residuals is None else whiteness.of_averages(residuals[0], self._average_s)

    def nis(self) -> Nis:
        """Return the nis of the judged samples."""
        return self._innovations.figures()


def failure(summary: ReplaySummary) -> str:
    """Return why a replay did not pass, in a line; empty when it did."""
    reasons = []
    if "fault" in summary.modes_s:
        reasons.append(f"the estimator was in mode fault for {summary.modes_s['fault']:g} s, restarted too often")
    if all(estimate.last is None for estimate in summary.estimates.values()):
        accepted, refused = summary.samples, summary.recording.refused
        reasons.append(f"no estimate was published: samples accepted: {accepted:,}, frames refused: {refused:,}")
    return " and ".join(reasons)


def verdict(summary: ReplaySummary) -> str:
    """Return the replay in a few sentences."""
    sentences = [
        f"Trouble: {failure(summary)}." if failure(summary) else "",
        summary.warning,
        *_troubles(summary),
        proof.in_words(summary.snapshots),
        _too_short(summary),
        *_time_estimated(summary),
        bounce.verdict(summary.stability),
        summary.comparison.in_words if summary.comparison else "",
        nis.verdict(summary.nis),
        whiteness.verdict(summary.whiteness),
    ]
    return " ".join(sentence for sentence in sentences if sentence)


def warning(summary: ReplaySummary, tune_command: str, evidence: Counter[str] | None = None) -> str:
    """Return what the estimator says against its estimates, and what to do; `tune_command` tunes the log."""
    said = trust.warning(summary.fault_shares, summary.flagged_share, evidence)
    step = trust.next_step(summary.fault_shares, tune_command, evidence)
    return f"{said} Next: {step}." if said and step else said


def _too_short(summary: ReplaySummary) -> str:
    """Return that nothing is judged, where the log ends before that begins."""
    duration = summary.recording.duration_s
    if summary.flagged_share is not None or not duration < CONVERGED_AFTER or failure(summary):
        return ""
    return f"Too short to judge: {rounded_down(duration, 3):g} s of estimates, {CONVERGED_AFTER:g} s are needed."


def _time_estimated(summary: ReplaySummary) -> list[str]:
    """For how much of the time there are estimates, where that is little."""
    sentences = []
    modes = summary.modes_s
    total, estimating = sum(modes.values()), modes.get("run", 0.0) + modes.get("frozen", 0.0)
    if total and estimating < 0.5 * total:
        sentences.append(
            f"Estimates exist for {in_percent(estimating / total):g} % of the time; elsewhere the first guess, or the "
            "last estimate, is shown."
        )
    return sentences


def _troubles(summary: ReplaySummary) -> list[str]:
    """Return what the reader has to know before believing the rest."""
    troubles, recording = [], summary.recording
    if mapping := recording.mapping:
        troubles += [f"{note}." for note in mapping.notes]
        troubles += _protection(mapping)
    if recording.refused:
        why = why_refused(summary.corrupt, summary.late)
        troubles.append(f"{recording.refused:,} frames were refused{f': {why}' if why else ''}.")
    if recording.ends_early:
        troubles.append(incomplete(recording.ends_early))
    if recording.damaged_lines:
        troubles.append(f"{recording.damaged_lines} of its lines are not frames.")
    if recording.gaps:
        gaps, longest = recording.gaps, recording.longest_gap_s
        where = f"{gaps} places, the longest gap" if gaps > 1 else "one place, a gap of"
        troubles.append(f"Samples are missing in {where} {longest:.3g} s.")
    if recording.clock_restarts:
        troubles.append(f"The sender's clock started over {recording.clock_restarts} times.")
    if recording.model_changes:
        troubles.append("A COMMAND in the log changes the model on the way; the estimates of the first one are shown.")
    step, period = recording.typical_step_s, summary.estimator.settings["sample_period"]
    if step and is_other_period(step, period):
        troubles.append(
            f"Samples come every {1e3 * step:g} ms, but sample_period is {1e3 * period:g} ms: add "
            f"--set sample_period={step:.4g}."
        )
    return troubles + _recorded_estimates(recording)


def _protection(mapping: Mapped) -> list[str]:
    """Return what E2E protection has found, or that there was none."""
    sentences = []
    for name, counts in mapping.messages.items():
        wrong = [f"{count:,} {what}" for what, count in vars(counts).items() if count and what != "frames"]
        if wrong:
            sentences.append(f"Of {counts.frames:,} frames of {name}: {', '.join(wrong)}.")
    if mapping.unprotected_frames:
        sentences.append(
            f"{mapping.unprotected_frames:,} frames are unprotected: the mapping names no E2E profile for them."
        )
    return sentences


def _recorded_estimates(recording: RecordingSummary) -> list[str]:
    """Return why estimates in the log are not compared with the new ones."""
    troubles = []
    if recording.answers_of_other_contract:
        troubles.append(
            "The estimates in the log are of another version of lever.dbc, or of an unknown one (IDENTITY): they are "
            "not compared."
        )
    if corrupt := recording.corrupt_recorded_answers:
        troubles.append(f"{corrupt:,} recorded estimates are corrupt (CRC or length): they are not compared.")
    if recording.misplaced_answers:
        troubles.append(f"{recording.misplaced_answers} recorded estimates do not belong to the sample before them.")
    return troubles
