"""What the sensors of a shipped scenario said over CAN, for all estimators alike, and what was true meanwhile.

Each seed is a run of the scenario in lock-step with the firmware, which may ask for dither: so that is in what was
measured. Values have passed the frames, with their resolution.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from lever_cdkf.firmware import quantities
from lever_cdkf.numeric.arrays import Array
from lever_cdkf.results.trace import Trace

from ..run import in_process
from ..run.columns import columns_of
from ..scenarios.scenario import Scenario, load
from ..toml_tables import ScenarioError
from .data import Batch, Truth
from .detrended import measured

_MEASURED_Y = ("theta_measured_rad", "theta_dot_measured_rad_s")
_MEASURED_U = ("z_ddot_measured_m_s2", "tau_m_measured_N_m")
_STATES = ("theta_true_rad", "theta_dot_true_rad_s")


def usable(scenario: Scenario) -> bool:
    """Return whether every sample is complete, as the estimators of a study need it."""
    return not scenario.sensors.dropout


def recorded(name: str, runs: int, seed: int, duration: float | None = None) -> Batch:
    """Return `runs` runs of a shipped scenario with the seeds from `seed` on, for its `duration` [s] or its own.

    Raise ScenarioError for one that is not there or has dropouts.
    """
    length = [] if duration is None else [f"duration={duration:g} s"]
    scenarios = [load(name, [*length, f"seed={seed + run}"]) for run in range(runs)]
    first = scenarios[0]
    if not usable(first):
        raise ScenarioError(f"{first.file}: has dropouts; an estimator of a study needs every sample")
    traces = [_run(scenario) for scenario in scenarios]
    settings, choices = first.config.settings, first.config.choices
    signals = (_columns(traces, _MEASURED_Y), _columns(traces, _MEASURED_U))
    parameters = [quantity.column("true") for quantity in quantities.parameters(choices["model"])]
    has_parameters = set(parameters) <= traces[0].keys()  # a pilot who is none of the model has no such parameters
    dynamics = _columns(traces, [quantity.column("true") for quantity in quantities.DYNAMICS])
    truth = Truth(_columns(traces, _STATES), _columns(traces, parameters) if has_parameters else None, dynamics)
    return measured(settings, choices["model"], choices["preload"], signals, truth)


def _run(scenario: Scenario) -> Trace:
    recording = in_process.run(scenario)
    return columns_of(recording, recording.frames())


def _columns(traces: list[Trace], names: Sequence[str]) -> Array:
    """Return (B, K, n)."""
    return np.stack([np.stack([columns[name] for name in names], axis=-1) for columns in traces])
