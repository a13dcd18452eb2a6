"""The run in words and figures: the verdict, the cards below it, and the tables. All figures come from the summary."""

import html
import re
from collections.abc import Iterable, Sequence
from typing import Any

from ..firmware import native
from ..firmware.quantities import LEAST_COVERAGE, Quantity
from ..results.nis import Nis
from ..results.summary import Quality
from .run import Run

NOTHING = "–"


def number(value: Any, digits: int = 3) -> str:
    """A figure for reading; a dash for one that is not there."""
    if value is None or value != value:
        return NOTHING
    if isinstance(value, str | bool):
        return str(value)
    if isinstance(value, int):
        return f"{value:,}".replace(",", "\u2009")
    return f"{value:.{digits}g}" if abs(value) < 10**digits else f"{value:.0f}"


def fixed(value: float | None, decimals: int) -> str:
    """A figure with so many decimals; a dash for one that is not there."""
    return NOTHING if value is None else f"{value:.{decimals}f}"


def percent(fraction: float | None) -> str:
    """A part of one as per cent."""
    return NOTHING if fraction is None else f"{100.0 * fraction:.0f} %"


def seconds(values: Sequence[float | None] | None) -> str:
    """Times after the start and each change [s]; "never" where it was not reached."""
    if not values:
        return NOTHING
    shown = " / ".join("never" if value is None else f"{value:.1f}" for value in values)
    return shown if values[-1] is None else f"{shown} s"


def figures_of(run: Run, quantity: Quantity) -> Quality | None:
    """The summary's figures of one quantity, when it has them."""
    return run.simulated.parameters.get(quantity.key) if run.simulated else None


def verdict(run: Run) -> str:
    """The headline."""
    if run.summary is None:
        text, mood = "A recorded run, whose truth is not known: the estimates from it.", ""
    else:
        text = run.summary.verdict
        mood = "bad" if not run.summary.passed else "" if _in_doubt(run) else "good"
    escaped = html.escape(text)
    for quantity in run.parameters:
        escaped = re.sub(rf"\b{quantity.key}\b", quantity.symbol, escaped)
    return f'<p class="verdict {mood}">{escaped}</p>'


def _in_doubt(run: Run) -> bool:
    """Whether the stated sigma, or the model, is not right by this run, whatever its limits allow."""
    covered = [entry.coverage_2sigma for entry in run.simulated.parameters.values()] if run.simulated else []
    too_small = any(share is not None and share < LEAST_COVERAGE for share in covered)
    return too_small or (run.whiteness is not None and not run.whiteness.white)


def cards(run: Run) -> str:
    """The figures behind the verdict."""
    judged = [quantity for quantity in run.quantities if figures_of(run, quantity)]
    shown = _accuracy_cards(run, judged) if judged else [_last_estimates(run)]
    return f'<div class="cards">{"".join(shown)}</div>'


def _card(title: str, rows: Iterable[tuple[str, str]], note: str) -> str:
    lines = "<br>".join(f"{value} <small>{label}</small>" for label, value in rows)
    return f'<div class="card"><h3>{title}</h3><div class="figures">{lines}</div><p>{note}</p></div>'


def _accuracy_cards(run: Run, judged: list[Quantity]) -> list[str]:
    def rows(key: str, show: Any) -> list[tuple[str, str]]:
        return [
            (f"{quantity.symbol} {quantity.name}", show(getattr(figures_of(run, quantity), key))) for quantity in judged
        ]

    after = run.simulated.scenario.converged_after_s if run.simulated else None
    since = f", from {number(after)} s after the start and each sudden change on" if after is not None else ""
    return [
        _card(
            "How well tracked",
            rows("rms_percent", lambda value: f"{fixed(value, 1)} %"),
            f"Root mean square of the error, in % of the truth{since}.",
        ),
        _card(
            "Coverage of ±2σ",
            rows("coverage_2sigma", percent),
            "Of the time the truth lay within ±2σ: 95 % of Gaussian errors do. Errors last for seconds, so a single "
            "run is partly luck; lever sim --seeds shows many.",
        ),
        _card(
            "How fast",
            rows("time_to_10_percent_s", seconds),
            "From the start / from each sudden change of the pilot, until within 10 % of the truth to stay.",
        ),
    ]


def _last_estimates(run: Run) -> str:
    rows = []
    for quantity in run.quantities:
        estimate, sigma = run.estimate(quantity), run.sigma(quantity)
        if estimate is not None and sigma is not None:
            value = f"{number(float(estimate[-1]))} ± {number(float(sigma[-1]), 2)}"
            value += "" if quantity.unit == "1" else f" {quantity.shown_unit}"
            rows.append((f"{quantity.symbol} {quantity.name}", value))
    return _card("Estimates at the end", rows, "With their standard deviation.")


# --- tables ----------------------------------------------------------------------------------------------------------


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Cells are HTML; the first column is the name of the row."""
    head = "".join(f"<th>{cell}</th>" for cell in header)
    body = "".join(f"<tr>{''.join(f'<td>{cell}</td>' for cell in row)}</tr>" for row in rows)
    top = f"<thead><tr>{head}</tr></thead>" if any(header) else ""
    return f'<div class="scroll"><table>{top}<tbody>{body}</tbody></table></div>'


def errors_table(run: Run) -> str:
    """Every figure that the summary has of every quantity."""
    titles = (("rms error", "%"), ("bias", "%"), ("within ±2σ", "%"), ("to within 10 %", "s"), ("to within 5 %", "s"))
    header = ("", *(f"{name}<br>[{unit}]" for name, unit in titles))
    rows = []
    for quantity in run.quantities:
        if figures := figures_of(run, quantity):
            coverage = figures.coverage_2sigma
            rows.append(
                (
                    f"{quantity.symbol} {quantity.name}",
                    fixed(figures.rms_percent, 2),
                    fixed(figures.bias_percent, 2),
                    fixed(None if coverage is None else 100.0 * coverage, 1),
                    _times(figures.time_to_10_percent_s),
                    _times(figures.time_to_5_percent_s),
                )
            )
    return table(header, rows) if rows else ""


def _times(values: Sequence[float | None] | None) -> str:
    return ", ".join("never" if value is None else f"{value:.2f}" for value in values) if values else NOTHING


def comparison_table(run: Run) -> str:
    """Replayed minus recorded, signal by signal."""
    compared = run.replayed.comparison if run.replayed else None
    header = ("", "unit", "samples", "identical", "mean", "rms", "largest", "at [s]", "rms ÷ σ")
    keys = ("unit", "samples", "identical_samples", "bias", "rms", "largest", "largest_at_s", "rms_in_sigma")
    if compared is None:
        return ""
    return table(
        header, [(name, *(number(getattr(each, key)) for key in keys)) for name, each in compared.signals.items()]
    )


def recorded(run: Run) -> str:
    """Where the samples come from, in a sentence; empty for a simulation."""
    recording = run.recording
    if not recording:
        return ""
    start = f" from {recording['start']} on" if recording["start"] else ""
    return f"A log, replayed: bus {recording['channel']}{start}."


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
    """What was in the log."""
    recording = run.recording
    if not recording:
        return ""
    rows = [(label, number(recording[key]), unit) for key, label, unit in _RECORDING_FIGURES]
    rows += [
        (f"left out: {kind.replace('_', ' ')}", number(count), "frames")
        for kind, count in recording["frames_left_out"].items()
    ]
    return table(("the log", "value", "unit"), rows)


RUN_FIGURES = (
    ("samples", "samples", ""),
    ("lost", "lost", "frames"),
    ("corrupt", "corrupt", "frames"),
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
        ("innovations inside their 95 % bound", number(None if inside is None else 100.0 * inside), "%"),
        ("largest correlation of residuals (white noise: 0)", number(run.whiteness and run.whiteness.largest), "1"),
    ]
    rows += [(label, number(getattr(run.summary, key, None)), unit) for key, label, unit in RUN_FIGURES]
    shares: dict[str, float | None] = {}
    if run.simulated:
        shares = {**run.simulated.fault_shares, "any that warns": run.simulated.flagged_share}
    rows += [
        (f"of the judged time with fault: {html.escape(name)}", number(None if share is None else 100.0 * share), "%")
        for name, share in shares.items()
    ]
    return table(("", "value", "unit"), [row for row in rows if row[1] != NOTHING])


def settings_table(run: Run) -> str:
    """The estimator's settings, what differs from the default in bold."""
    rows = []
    for setting in native.settings_table():
        value = run.settings[setting.name]
        shown = f"{value:g}" if value == setting.default else f"<strong>{value:g}</strong>"
        rows.append((setting.name, shown, setting.unit, f'<span class="words">{html.escape(setting.meaning)}</span>'))
    return table(("setting", "value", "unit", "meaning"), rows)


def flat(values: Any, prefix: str = "") -> list[tuple[str, str]]:
    """A nested dictionary as rows of dotted key and value, for the tables of how the run was made."""
    if isinstance(values, dict):
        return [row for key, value in values.items() for row in flat(value, f"{prefix}.{key}" if prefix else str(key))]
    if isinstance(values, list | tuple) and any(isinstance(value, dict) for value in values):
        return [row for index, value in enumerate(values) for row in flat(value, f"{prefix}.{index}")]
    if isinstance(values, list | tuple):
        return [(prefix, ", ".join(number(value, 6) for value in values))] if values else []
    return [] if values is None or values == "" else [(prefix, number(values, 6))]
