"""bounce.html: the table, and of each condition the flight in which it was worst."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from lever_cdkf.firmware.aircraft import ALARM, WARNING
from lever_cdkf.report.figure import Figure, Spec, axis, band, edges, line, time_axis
from lever_cdkf.report.page import Page
from lever_cdkf.text.counts import counted

from ..acceptance import acceptance_page
from .flights import AIRCRAFT, FIVE
from .measure import Excerpt
from .run_conditions import BounceResult

_MOST = 15.0  # [dB]
_LEGEND = {"orientation": "h", "x": 0, "y": 1.06, "yanchor": "bottom", "traceorder": "normal"}
"""Above the names of the moments."""


def build(results: Sequence[BounceResult], seeds: int) -> str:
    """Return the whole page."""
    page = Page(
        "Collective bounce: seen coming, and how far it is held off",
        f"{counted(seeds, 'random pilot')} with each of {len(AIRCRAFT)} aircraft, or with {len(FIVE)} in turn "
        f"where it is about what lies between accelerometer and pilot ({', '.join(FIVE)}), "
        "the firmware as shipped in the loop. What "
        "limits the mitigation is that airframe and body: mount the accelerometer on the structure that carries the "
        "pilot's seat. "
        "Charts: of each condition the flight in which its first figure was worst.",
        "lever bounce",
    )
    charts = [
        None if result.excerpt is None else _chart(result.excerpt, str(result.worst_run(result.condition.figures[0])))
        for result in results
    ]
    return acceptance_page.build(page, results, charts, "Gearing is collective pitch over the lever's angle.")


def _chart(shown: Excerpt, flight: str) -> Figure:
    """Return the margin with the limits of warning and alarm, what the lever and the cabin do, and when what came."""
    rows = [axis("margin [dB]", range=[-5.0, _MOST], weight=1.5), axis("lever [°]"), axis("cabin [m/s²]")]
    figure = Figure(rows, time_axis(float(shown.time[-1])), height=480)
    margin = np.minimum(shown.margin, _MOST)
    figure.add(*band(shown.time, *edges(margin, shown.sigma, most=_MOST), "estimate ± 2σ", "estimate-band"))
    figure.add(
        line(shown.time, np.minimum(shown.true, _MOST), f"truth ({flight})", "truth", line_dash="dash", zorder=1)
    )
    figure.add(line(shown.time, margin, "estimate", "estimate"))
    figure.add(
        line(shown.time, shown.theta, "θ", "text", 1), line(shown.time, shown.correction, "correction", "good", 1)
    )
    figure.add(line(shown.time, shown.z_ddot, "z̈", "torque", 2))
    figure.level(0.0, WARNING, ALARM)
    for level, word, anchor in ((WARNING, "warning", "bottom"), (ALARM, "alarm", "top"), (0.0, "unstable", "top")):
        at: Spec = {"xref": "paper", "x": 1.0, "xanchor": "right", "yref": "y", "y": level, "yanchor": anchor}
        figure.annotations.append({"text": f"{word}: {level:g} dB", "showarrow": False, "font": {"size": 10}} | at)
    figure.mark(list(shown.moments.values()))
    for place, (name, moment) in enumerate(shown.moments.items()):
        side = {"xanchor": "right" if place == 0 else "left", "yanchor": "bottom", "showarrow": False}
        figure.annotations.append({"x": moment, "y": 1.0, "yref": "paper", "text": name} | side)
    figure.more |= {"legend": _LEGEND}
    return figure
