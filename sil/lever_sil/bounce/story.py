"""Two flights of one pilot who relaxes, with mitigation and without: the first picture of the demo's report."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from lever_cdkf.firmware.library import lib
from lever_cdkf.report.figure import Figure, Spec, axis, band, edges, hover, line, time_axis
from lever_cdkf.report.page import Story
from lever_cdkf.text.units import GRAVITY

from . import pilots
from .conditions import BOTH
from .flights import STRIDE, Plan, fly
from .measure import geared

TITLE = "Collective bounce, seen coming and stopped"
CAPTION = (
    "A pilot in a UH-60-like helicopter in gusts of 0.05 g relaxes: from 10 to 40 s the damping of his arm falls from "
    "42 to 18 N s/m, and with it the gain margin of the loop through arm, lever and rotor. The same flight twice: "
    "without mitigation it ends in a limit cycle, with cancellation and lever damping it goes on. The dotted line is "
    "where the firmware raises its alarm; it knows the helicopter by a table of its response. While the damping falls, "
    "the estimate follows some seconds behind, and so is 1 to 2 dB above the truth, within its ±2σ. Made by the same "
    "simulation as <code>lever bounce</code>."
)
_BEYOND = 1.2  # gearing over critical in the end
_MOST = 10.0  # [dB]


def tell() -> Story:
    """Return margin, lever, correction and cabin in both flights. Raise LeverError."""
    plan = geared(Plan("uh60_like", 1, pilots.relaxing(1), 1.0), _BEYOND)
    without, mitigated = fly(plan), fly(replace(plan, mitigation=BOTH))
    rows = [axis("gain margin [dB]", range=[-5.0, _MOST])]
    rows += [axis(title) for title in ("lever [°]", "correction [°]", "cabin [g]")]
    figure = Figure(rows, time_axis(plan.duration), height=620)
    time, said = mitigated.notes[::5], mitigated.stability[::5]
    margin, sigma = (np.minimum(said[name], _MOST) for name in ("gain_margin", "gain_margin_sigma"))
    figure.add(*band(time, *edges(margin, sigma, most=_MOST), "estimate ± 2σ", "estimate-band"))
    true = np.minimum(mitigated.margins(5), _MOST)
    look: Spec = {"line_dash": "dash", "zorder": 1}
    figure.add(
        line(time, true, "true margin", "truth", **look, **hover("true gain margin", "dB")),
        line(time, margin, "estimate", "estimate", **hover("estimated gain margin", "dB")),
    )
    for flown, name, colour in ((without, "without mitigation", "fault"), (mitigated, "with mitigation", "good")):
        angle, z_ddot = np.degrees(flown.theta - flown.theta[0]), flown.z_ddot / GRAVITY
        figure.add(
            line(time, angle[:: 5 * STRIDE], name, colour, 1, **hover(f"lever {name}", "°")),
            line(time, z_ddot[:: 5 * STRIDE], name, colour, 3, **hover(f"cabin {name}", "g")),
        )
    correction = np.degrees(mitigated.correction[:: 5 * STRIDE])
    figure.add(line(time, correction, "with mitigation", "good", 2, **hover("correction with mitigation", "°")))
    figure.level(0.0)
    alarms = mitigated.notes[mitigated.stability["state"] == lib.LEVER_BOUNCE_ALARM]
    for alarm in alarms[:1].tolist():
        figure.mark([alarm])
        word = {"text": "alarm", "showarrow": False, "xanchor": "right"}
        figure.annotations.append({"x": alarm, "y": 0.8 * _MOST, **word})
    return Story(TITLE, figure, CAPTION)
