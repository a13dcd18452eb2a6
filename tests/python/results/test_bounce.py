"""How near bounce was, from columns that are known, in pieces; and the sentence on it."""

from __future__ import annotations

import numpy as np
from lever_cdkf.firmware.aircraft import AircraftResponse
from lever_cdkf.firmware.library import enum_names
from lever_cdkf.results.bounce import Bounce, verdict
from lever_cdkf.results.summary import Stability

AIRCRAFT = AircraftResponse(
    [1.0, 2.0, 3.0], [1.0 + 0j, 1j, 0.5 + 0j], gain_sigma=0.1, phase_sigma=0.1, warning=6.5, alarm=3.25, name="a bird"
)
NUMBERS = {name: float(number) for number, name in enum_names("lever_bounce").items()}


def test_what_it_comes_to() -> None:
    time = np.arange(10) * 0.5
    columns = {
        "time_s": time,
        "bounce": np.array([np.nan, *[NUMBERS["clear"]] * 4, *[NUMBERS["warning"]] * 3, *[NUMBERS["alarm"]] * 2]),
        "gain_margin_dB": np.array([np.nan, 9.0, 8.0, 7.0, 7.5, 6.0, 2.0, 5.0, 3.0, np.nan]),
        "gain_margin_sigma_dB": 0.1 * np.arange(10),
        "correction_rad": np.array([np.nan, 0.01, -0.03, 0.02, *[0.0] * 6]),
        "gain_margin_true_dB": np.array([np.nan, 9.0, 8.0, 7.0, 7.0, 1.0, -1.5, -0.5, 1.0, 2.0]),
    }
    gathered = Bounce(0.5)
    for part in (slice(0, 3), slice(3, 8), slice(8, None)):
        gathered.add({name: values[part] for name, values in columns.items()})
    assert gathered.summary(AIRCRAFT) == Stability(
        states_s={"clear": 2.0, "warning": 1.5, "alarm": 1.0},
        least_margin_db=2.0,
        its_sigma_db=0.1 * 6.0,
        at_s=3.0,
        warning_db=6.5,
        alarm_db=3.25,
        greatest_correction_rad=0.03,
        aircraft="a bird",
        least_true_margin_db=-1.5,
        unstable_s=1.0,
    )


def test_without_columns_or_values_nothing_is_known() -> None:
    gathered = Bounce(0.5)
    gathered.add({"time_s": np.arange(3.0)})
    nothing = np.full(3, np.nan)
    names = ("bounce", "gain_margin_dB", "gain_margin_sigma_dB", "correction_rad")
    gathered.add({"time_s": np.arange(3.0), **dict.fromkeys(names, nothing)})
    found = gathered.summary(AIRCRAFT)
    assert found == Stability({}, None, None, None, 6.5, 3.25, None, "a bird", None, None)
    assert verdict(found) == "With a bird, the margin to collective bounce was never known."
    assert verdict(None) == ""
