"""A short run of the real thing, with a sudden change and dropouts, and its report."""

from __future__ import annotations

from pathlib import Path

import pytest
from lever_cdkf.report import write_report
from lever_sil.run.runner import SimulationResult, simulate
from lever_sil.scenarios import scenario

SCENARIO = """
title = "Short & sudden"
description = "A pilot <startled> after 8 s; the angle is missing for a while."
duration = "16 s"
converged_after = "4 s"
seed = 5
[pilot]
trim = "20 deg"
m_p = "3 kg"
c_p = { kind = "steps", first = "40 N s/m", at = ["8 s"], to = ["60 N s/m"] }
k_p = { kind = "steps", first = "1700 N/m", at = ["8 s"], to = ["2600 N/m"] }
[[base]]
kind = "noise"
rms = "0.1 g"
low = "1 Hz"
high = "10 Hz"
[[torque]]
kind = "firmware"
rms = "0.3 N m"
[sensors]
theta = { noise = "1 mrad" }
theta_dot = { noise = "10 mrad/s" }
[[sensors.dropout]]
what = "theta"
share = "100 %"
start = "12 s"
end = "13 s"
[[sensors.dropout]]
what = "lever_frame"
share = "1 %"
"""


def run(name: str, *overrides: str) -> SimulationResult:
    """Return a scenario through the firmware in this process."""
    return simulate(scenario.load(name, overrides))


@pytest.fixture(scope="session")
def result(tmp_path_factory: pytest.TempPathFactory) -> SimulationResult:
    file = tmp_path_factory.mktemp("scenario") / "short.toml"
    file.write_text(SCENARIO)
    return run(str(file))


@pytest.fixture(scope="session")
def report(result: SimulationResult, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("report") / "report.html"
    write_report(result.trace, result.summary, path)
    return path
