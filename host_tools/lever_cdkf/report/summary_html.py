"""The run in words and figures: the answer, and the tables. All figures come from the summary."""

import html
import re
from collections.abc import Iterable, Sequence
from typing import Any

from ..cli.tables import Cell, Row
from ..firmware import native
from ..firmware.quantities import DYNAMICS, LEAST_COVERAGE, Quantity
from ..results import trust
from ..results.faults import LITTLE
from ..results.nis import Nis
from ..results.summary import Quality
from ..text.counts import in_percent
from .run import Run

NOTHING = "–"
_UNJUDGED = "A recorded run, whose truth is not known."
LARGEST_ERROR = 10.0  # [% rms] of a run that is called good


def number(value: Any, digits: int = 3) -> str:
    """Return a figure for reading; a dash for one that is not there."""
    if value is None or value != value:
        return NOTHING
    if isinstance(value, str | bool):
        return str(value)
    if isinstance(value, int):
        return f"{value:,}".replace(",", "\u2009")
    text = f"{value:.{digits}g}"
    return f"{value:.0f}" if "e+" in text else text


def fixed(value: float | None, decimals: int, unit: str = "") -> str:
    """Return a figure with so many decimals and its unit; a dash for one that is not there."""
    return NOTHING if value is None else f"{value:.{decimals}f}{unit}"


def percent(fraction: float | None) -> str:
    """Return a part of one as per cent."""
    return NOTHING if fraction is None else f"{in_percent(fraction):g} %"


def seconds(values: Sequence[float | None] | None) -> str:
    """Return times after the start and each change [s]; a dash where it was not reached."""
    if not values or all(value is None for value in values):
        return NOTHING
    return f"{' / '.join(fixed(value, 1) for value in values)} s"


def figures_of(run: Run, quantity: Quantity) -> Quality | None:
    """Return the summary's figures of one quantity, when it has them."""
    return run.simulated.parameters.get(quantity.key) if run.simulated else None


def answer(run: Run) -> str:
    """Return the headline, the figures behind it, and what the summary says."""
    judged = [quantity for quantity in run.quantities if figures_of(run, quantity)]
    figures, note = _accuracy(run, judged) if judged else (_last_estimates(run), "")
    said = run.summary.verdict.replace(run.summary.warning, "").strip() if run.summary else _UNJUDGED
    text = html.escape(said)
    for quantity in run.parameters:
        text = re.sub(rf"\b{quantity.key}\b", quantity.symbol, text)
    text = text.replace(" %", "\u00a0%")
    return f'{verdict(run)}{figures}<p class="said">{text}</p><p class="note">{note}</p>'


def verdict(run: Run) -> str:
    """Return the headline: a warning of the estimator before any figure."""
    warning = html.escape(run.summary.warning).replace(" %", "\u00a0%") if run.summary else ""
    lines = [f"<strong>{warning}</strong>", _headline(run)] if warning else [f"<strong>{_headline(run)}</strong>"]
    return f'<p class="verdict {_mood(run)}">{"<br>".join(lines)}</p>'


def _headline(run: Run) -> str:
    """Return the headline of the natural frequency: how well it was estimated.

    Where its truth is not known, it is what it was at the end.
    """
    quantity = DYNAMICS[0]
    figures = figures_of(run, quantity)
    if figures and figures.rms_percent is not None:
        missed = "Limits missed. " if run.simulated and run.simulated.missed else ""
        covered = percent(figures.coverage_2sigma)
        return f"{missed}Natural frequency: {figures.rms_percent:.1f} % rms error; within ±2σ {covered} of the time"
    value = _last(run, quantity)
    return f"Natural frequency at the end: {value}" if value else "No estimate"


def _mood(run: Run) -> str:
    """Good only where sigma and model are right by this run, and errors small, whatever its limits allow."""
    if run.simulated is None:
        if run.summary is not None and not run.summary.passed:
            return "bad"
        warned = (run.summary.flagged_share if run.summary else None) or 0.0
        return "bad" if warned >= trust.MOST else "watch" if warned > LITTLE else ""
    if not run.simulated.passed or (run.simulated.flagged_share or 0.0) >= trust.MOST:
        return "bad"
    figures = run.simulated.parameters.values()
    sure = all((each.coverage_2sigma or 0.0) >= LEAST_COVERAGE for each in figures)
    small = all((each.rms_percent or 0.0) <= LARGEST_ERROR for each in figures)
    white = run.whiteness is None or run.whiteness.white
    return "good" if sure and small and white and figures else "watch"


def _accuracy(run: Run, judged: list[Quantity]) -> tuple[str, str]:
    """Return a table, and what its columns mean."""
    rows = []
    for quantity in judged:
        figures = figures_of(run, quantity)
        assert figures is not None
        rows.append(
            (
                f"{quantity.symbol} {quantity.name}",
                fixed(figures.rms_percent, 1, " %"),
                percent(figures.coverage_2sigma),
                seconds(figures.time_to_10_percent_s),
            )
        )
    after = run.simulated.scenario.converged_after_s if run.simulated else None
    since = f", from {number(after)} s after the start and each sudden change on" if after is not None else ""
    note = (
        f"rms error: in % of the truth{since}. In ±2σ: part of that time with the truth within ±2σ; 95 % of Gaussian "
        "errors are, but errors last for seconds, so a single run is partly luck (<code>lever sim --seeds</code> shows "
        "many). Stays below 10 % after: from the start / from each sudden change, until the error was below for good. "
        f"{NOTHING}: it was above once more just before the next change, or before the end."
    )
    return table(("", "rms error", "in ±2σ", "stays below<br>10 % after"), rows), note


def _last_estimates(run: Run) -> str:
    rows = [(f"{each.symbol} {each.name}", value) for each in run.quantities if (value := _last(run, each))]
    return table(("", "at the end, ± one σ"), rows)


def _last(run: Run, quantity: Quantity) -> str:
    """Return the last estimate with its standard deviation; empty without one."""
    estimate, sigma = run.estimate(quantity), run.sigma(quantity)
    if estimate is None or sigma is None:
        return ""
    unit = "" if quantity.unit == "1" else f" {quantity.shown_unit}"
    return f"{number(float(estimate[-1]))} ± {number(float(sigma[-1]), 2)}{unit}"


# --- tables ----------------------------------------------------------------------------------------------------------


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table whose cells are HTML; the first column is the name of the row."""
    head = "".join(f"<th>{cell}</th>" for cell in header)
    body = "".join(f"<tr>{''.join(f'<td>{cell}</td>' for cell in row)}</tr>" for row in rows)
    top = f"<thead><tr>{head}</tr></thead>" if any(header) else ""
    return f'<div class="scroll"><table>{top}<tbody>{body}</tbody></table></div>'


def rows_table(rows: Sequence[Row], digits: int = 4) -> str:
    """Return rows as commands print them, numbers with so many digits; nothing without rows."""
    if not rows:
        return ""
    prose = [
        name for name in list(rows[0])[1:] if any(" " in cell for row in rows if isinstance(cell := row[name], str))
    ]

    def shown(name: str, cell: Cell) -> str:
        text = html.escape(number(cell, digits))
        return f'<span class="words">{text}</span>' if name in prose else text

    return table([shown(name, name) for name in rows[0]], ([shown(*cell) for cell in row.items()] for row in rows))


def errors_table(run: Run) -> str:
    """Return every figure that the summary has of every quantity."""
    titles = (
        ("rms error", "%"),
        ("bias", "%"),
        ("within ±2σ", ""),
        ("stays below 10 % after", "s"),
        ("below 5 %", "s"),
    )
    header = ("", *(f"{name}<br>{unit and f'[{unit}]'}" for name, unit in titles))
    rows = [
        (
            f"{quantity.symbol} {quantity.name}",
            fixed(figures.rms_percent, 2),
            fixed(figures.bias_percent, 2),
            percent(figures.coverage_2sigma),
            _times(figures.time_to_10_percent_s),
            _times(figures.time_to_5_percent_s),
        )
        for quantity in run.quantities
        if (figures := figures_of(run, quantity))
    ]
    return table(header, rows) if rows else ""


def _times(values: Sequence[float | None] | None) -> str:
    return ", ".join(fixed(value, 2) for value in values) if values else NOTHING


def comparison_table(run: Run) -> str:
    """Replayed minus recorded, signal by signal."""
    compared = run.replayed.comparison if run.replayed else None
    return rows_table(compared.rows(), 3) if compared else ""


def recorded(run: Run) -> str:
    """Where the samples come from, in a sentence; empty for a simulation."""
    recording = run.recording
    if recording is None:
        return ""
    start = f" from {recording.start} on" if recording.start else ""
    return f"A log, replayed: bus {recording.channel}{start}."


_RECORDING_FIGURES = (
    ("frames", "frames in the log", ""),
    ("damaged_lines", "damaged lines", ""),
    ("refused", "frames that the estimator refused", ""),
    ("repeated", "frames that repeat the one before", ""),
    ("corrupt_recorded_answers", "corrupt recorded estimates", "frames"),
    ("misplaced_answers", "recorded estimates of other samples", "frames"),
    ("commands", "COMMAND frames", ""),
    ("gaps", "gaps between samples", ""),
    ("longest_gap_s", "longest gap", "s"),
    ("late_samples", "samples not newer than the one before", ""),
    ("clock_wraps", "wraps of the sample time", ""),
    ("clock_restarts", "restarts of the sender's clock", ""),
    ("recorder_clock_jumps", "jumps of the recorder's clock", ""),
)


def recording_table(run: Run) -> str:
    """Return what was in the log."""
    recording = run.recording
    if recording is None:
        return ""
    rows = [(label, number(getattr(recording, key)), unit) for key, label, unit in _RECORDING_FIGURES]
    rows += [
        (f"left out: {kind.replace('_', ' ')}", number(count), "frames")
        for kind, count in recording.frames_left_out.items()
    ]
    return table(("the log", "value", "unit"), rows)


RUN_FIGURES = (
    ("samples", "samples", ""),
    ("lost", "lost", "frames"),
    ("corrupt", "corrupt frames and implausible values", ""),
    ("late", "late", "frames"),
    ("restarts", "restarts of the filter", ""),
    ("unanswered", "samples without an answer", ""),
    ("misplaced", "estimates of other samples", ""),
    ("simulated_time_s", "simulated time", "s"),
    ("wall_time_s", "computing time", "s"),
    ("wall_time_per_simulated_time", "computing time ÷ simulated time", "1"),
)


def run_table(run: Run) -> str:
    """Innovations, traffic, time and faults."""
    nis = run.summary.nis if run.summary else Nis()
    inside = nis.inside_95_percent
    rows = [
        ("mean normalised innovation squared", number(nis.mean), "1"),
        ("the same if σ is right", number(nis.expected), "1"),
        ("innovations inside their 95 % bound", percent(inside), ""),
        ("largest correlation of residuals", number(run.whiteness and run.whiteness.largest), "1"),
    ]
    rows += [(label, number(getattr(run.summary, key, None)), unit) for key, label, unit in RUN_FIGURES]
    shares: dict[str, float | None] = {}
    time = "judged time"
    if run.summary:
        shares = {**run.summary.fault_shares, "any that warns": run.summary.flagged_share}
        time = "time" if run.summary.flagged_share is None else time
    rows += [(f"of the {time} with fault: {html.escape(name)}", percent(share), "") for name, share in shares.items()]
    return table(("", "value", "unit"), [row for row in rows if row[1] != NOTHING])


def settings_table(run: Run) -> str:
    """Return the estimator's settings, what differs from the default in bold; the others are not printed on paper."""
    rows = []
    for setting in native.settings_table():
        value = run.settings[setting.name]
        shown = f'<span class="default">{value:g}</span>' if value == setting.default else f"<strong>{value:g}</strong>"
        rows.append((setting.name, shown, setting.unit, f'<span class="words">{html.escape(setting.meaning)}</span>'))
    return table(("setting", "value", "unit", "meaning"), rows)


def flat(values: Any, prefix: str = "") -> list[tuple[str, str]]:
    """Return a nested dictionary as rows of dotted key and value, for the tables of how the run was made."""
    if isinstance(values, dict):
        return [row for key, value in values.items() for row in flat(value, f"{prefix}.{key}" if prefix else str(key))]
    if isinstance(values, list | tuple) and any(isinstance(value, dict) for value in values):
        return [row for index, value in enumerate(values) for row in flat(value, f"{prefix}.{index}")]
    if isinstance(values, list | tuple):
        return [(prefix, ", ".join(number(value, 6) for value in values))] if values else []
    return [] if values is None or values == "" else [(prefix, number(values, 6))]
