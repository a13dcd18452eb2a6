"""The page of `lever tune --page`: before and after, in the style of report.html."""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence

import numpy as np

from ..cli.tables import Row
from ..report.figure import Figure, Spec, axis, band, dots, line
from ..report.page import Page
from ..report.summary_html import rows_table
from ..results.whiteness import CANNOT_SEE, averages
from .search import Tuned
from .validation import Fit

_TITLE = "Settings from a log"
_COLOURS = {"before": "base", "after": "estimate"}
_OUTPUTS = ("θ", "θ̇")
_WINDOW = 1.0  # [s] over which innovations are averaged
_OPEN = 10.0  # an interval without an end is drawn beyond the last value by this factor


def build(
    subtitle: str,
    verdict: str,
    tables: Mapping[str, Sequence[Row]],
    calibration: str,
    tuned: Sequence[Tuned],
    fits: Sequence[Fit],
) -> str:
    """Return the whole page. `tables` are as they are printed; `calibration` says in words what is known of that."""
    page = Page(_TITLE, html.escape(subtitle), "lever tune")
    calibrated, settings, numbers = (
        _table(title, tables.get(title, ())) for title in ("calibration", "settings", "before and after")
    )
    chart = page.figure(
        "intervals",
        _intervals(tuned),
        "Bar: what the log does not contradict (95 % likelihood interval, the other settings as found); one that runs "
        "out of the figure has no end. Hollow: before. Full: after.",
    )
    paragraph = f"<p>{html.escape(calibration)}</p>" if calibration else ""
    page.section("calibration", "Calibration", "Accelerometer and friction", paragraph, calibrated)
    page.section("settings", "Settings", "What the log says of the settings", chart, settings)
    page.section("fits", "Before and after", "Before and after", numbers, *_innovations(page, fits))
    return page.html(f'<p class="verdict">{html.escape(verdict)}</p>')


def _table(title: str, rows: Sequence[Row]) -> str:
    return f"<h3>{html.escape(title)}</h3>{rows_table(rows)}" if rows else ""


def _intervals(tuned: Sequence[Tuned]) -> Figure | None:
    """Return a lane for each setting, over its value as a part of what it was."""
    if not tuned:
        return None
    names = [entry.name for entry in reversed(tuned)]
    lanes = axis("", tickvals=list(range(len(names))), ticktext=names, range=[-0.6, len(names) - 0.4], automargin=True)
    figure = Figure([lanes], axis("value ÷ value before", type="log"), 90 + 30 * len(names), over_time=False)
    for lane, entry in enumerate(reversed(tuned)):
        values = [value for value in (entry.low, entry.high, entry.after, entry.before) if value is not None]
        low = min(values) / _OPEN if entry.low is None else entry.low
        high = max(values) * _OPEN if entry.high is None else entry.high
        ends = np.array((low, high)) / entry.before
        bar = line(ends, np.full(2, float(lane)), "not contradicted", "estimate-band", line_width=12, hoverinfo="skip")
        marker = {"color": "@estimate", "size": 9}
        label = {"hovertemplate": f"{entry.name} %{{x:.3g}}<extra></extra>"}
        figure.add(
            bar,
            _dot(1.0, lane, "before", marker | {"symbol": "circle-open", "color": "@base"}, label),
            _dot(entry.after / entry.before, lane, "after", marker, label),
        )
    return figure


def _dot(x: float, lane: int, name: str, marker: Spec, more: Spec) -> Spec:
    return dots(np.array((x,)), np.array((float(lane),)), name, "estimate", marker=dict(marker), **more)


# --- innovations -----------------------------------------------------------------------------------------------------


def _innovations(page: Page, fits: Sequence[Fit]) -> tuple[str, ...]:
    """Return the innovations of the part that was held out, or, if none was, of the one that was tuned on.

    Noise is as set.
    """
    part = fits[-1].part
    shown = [fit for fit in fits if fit.noise == "as set" and fit.part == part]
    return (
        page.figure(
            "sizes",
            _sizes(shown),
            f"Innovations of the part {part}, over what the filter predicts of them: root mean square over a second. "
            "At 1 the noise of the settings is that of the log.",
        ),
        page.figure(
            "correlation",
            _correlation(shown),
            f"Autocorrelation of the innovations of θ̇ on the part {part}, as averages over 20 ms. White noise stays in "
            f"the band at 95 % of the lags. {CANNOT_SEE}",
        ),
    )


def _sizes(fits: Sequence[Fit]) -> Figure:
    rows = [axis(f"{name} [1]", rangemode="tozero") for name in _OUTPUTS]
    figure = Figure(rows, axis("time in this part [s]"), 360, over_time=False)
    for fit in fits:
        size = max(1, round(_WINDOW / fit.period))
        count = len(fit.innovations) // size
        value, sigma = (fit.innovations[field][: count * size].astype(np.float64) for field in ("value", "sigma"))
        ratio = np.divide(value, sigma, out=np.full(value.shape, np.nan), where=sigma > 0.0)
        for row in range(len(_OUTPUTS)):
            level, colour = np.sqrt(averages(np.square(ratio[:, row]), size)), _COLOURS[fit.settings]
            figure.add(line((np.arange(count) + 0.5) * _WINDOW, level, fit.settings, colour, row))
    return figure


def _correlation(fits: Sequence[Fit]) -> Figure | None:
    figure = Figure([axis("autocorrelation [1]")], axis("lag [s]"), 280, over_time=False)
    for fit in fits:
        measured = fit.correlation
        if measured is None:
            return None
        lags = measured.average_s * np.arange(1, len(measured.autocorrelation) + 1)
        if not figure.traces:
            edge = np.full(len(lags), measured.band_95)
            figure.add(*band(lags, -edge, edge, "white noise, 95 %", "chance-band"))
        figure.add(line(lags, np.array(measured.autocorrelation), fit.settings, _COLOURS[fit.settings]))
    return figure
