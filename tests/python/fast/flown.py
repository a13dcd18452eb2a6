"""A whole run of the closed loop in C, as the tests look at it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from lever_cdkf.firmware import quantities
from lever_cdkf.numeric.arrays import FloatArray
from lever_sil.fast.closed_loop import Loop
from lever_sil.scenarios import inputs as scenario_inputs
from lever_sil.scenarios.scenario import Scenario
from numpy.typing import NDArray


@dataclass(frozen=True)
class Flown:
    """Arrays with a value for each of the times; estimates and standard deviations by name, as the truth."""

    time: FloatArray
    truth: Mapping[str, FloatArray]
    theta: FloatArray
    theta_dot: FloatArray
    estimate: Mapping[str, FloatArray]
    sigma: Mapping[str, FloatArray]
    nis: FloatArray
    faults: NDArray[np.uint32]
    mode: NDArray[np.uint32]


def fly(scenario: Scenario, by_frames: bool = False, stride: float = 0.02) -> Flown:
    """Run a scenario against a fresh instance of the firmware, looked at each `stride` seconds. Raise LeverError."""
    inputs = scenario_inputs.prepare(scenario)
    every = max(1, round(stride / scenario.period))
    loop = Loop(scenario, inputs, by_frames=by_frames, every=every)
    loop.advance(len(inputs.time))
    loop.check()
    estimates, healths = loop.outputs
    names = [each.key for each in quantities.parameters(scenario.config.choices["model"])]
    values, sigma = {}, {}
    for index, name in enumerate(names):
        values[name] = estimates["parameter"][:, index].astype(np.float64)
        sigma[name] = estimates["parameter_sigma"][:, index].astype(np.float64)
    for name in ("natural_frequency", "damping_ratio"):
        values[name] = estimates[name].astype(np.float64)
        sigma[name] = estimates[f"{name}_sigma"].astype(np.float64)
    truth = inputs.truth.at(slice(None, None, every))
    return Flown(
        time=inputs.time[::every],
        truth={**truth.parameters, **vars(truth.dynamics)},
        theta=loop.signals["theta"][::every],
        theta_dot=loop.signals["theta_dot"][::every],
        estimate=values,
        sigma=sigma,
        nis=estimates["nis"].astype(np.float64),
        faults=healths["faults"],
        mode=healths["mode"],
    )
