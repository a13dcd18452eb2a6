"""The estimators of a campaign: the firmware's two, and those baselines that can be run on the same data."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from lever_cdkf.firmware.native import DO_NOT_TRUST, Config, run_samples
from lever_cdkf.numeric.arrays import Array

from ..measures import covariance_of, is_flagged
from ..scenarios.scenario import Scenario
from ..study.baselines import BASELINES
from ..study.data import PARAMETERS, Batch, Estimates, Truth
from ..study.detrended import measured
from ..study.matched import KINDS
from ..study.transitions import dynamics_gradient, with_dynamics
from .flight import Columns, Flight, beside


@dataclass(frozen=True)
class Track:
    """What an estimator said in B flights at T times."""

    values: Array
    """(B, T, 5) parameters, natural frequency [Hz], damping ratio; NaN from where it broke down."""
    sigma: Array
    """(B, T, 5) their standard deviations; NaN where none are stated."""
    scaled: Array
    """(B, T, 3) parameters as the filter's coordinates: logarithms where they are positive."""
    covariance: Array | None
    """(B, T, 3, 3) of `scaled`."""
    nis: Array | None
    """(B, T)"""
    flagged: Array | None = None
    """(B, T) 1 where it says that it is not to be trusted."""


class Entrant(ABC):
    """An estimator."""

    name: str
    title: str
    cost: float
    """Processor time for a minute of flight [s], roughly: a constant, as it makes the size of chunks."""

    @abstractmethod
    def unfit(self, scenario: Scenario) -> str:
        """Return why it cannot be run on flights like this; empty if it can."""

    def flies_in(self, scenario: Scenario) -> bool:
        """Return whether it is the firmware in the loop; if not, it is given afterwards what was measured."""
        return False

    @abstractmethod
    def track(self, flights: Sequence[Flight]) -> Track:
        """Run over flights of one point. Raise LeverError."""


class Firmware(Entrant):
    """The C code, with the choices and settings of the scenario."""

    cost = 0.03

    def __init__(self, name: str) -> None:
        self.name, self.title = name, f"firmware, {name}"

    def unfit(self, scenario: Scenario) -> str:
        """Return "": the firmware can be run on all flights."""
        return ""

    def track(self, flights: Sequence[Flight]) -> Track:
        """Return the firmware's own estimates, in flight or replayed afterwards."""
        columns = [self._run(flight) for flight in flights]
        merged = {name: np.stack([each[name] for each in columns]).astype(np.float64) for name in _TAKEN}
        dynamics = ("natural_frequency", "damping_ratio")
        values = np.concatenate((merged["parameter"], *(merged[name][..., None] for name in dynamics)), axis=-1)
        sigma = np.concatenate(
            (merged["parameter_sigma"], *(merged[f"{name}_sigma"][..., None] for name in dynamics)), axis=-1
        )
        kind = KINDS.get(flights[0].scenario.config.choices["model"])
        if kind is None or kind.positive:
            scaled, scale = np.log(merged["parameter"]), merged["parameter"]
        else:
            scaled, scale = merged["parameter"], np.ones_like(merged["parameter"])
        covariance = covariance_of(merged["parameter_sigma"] / scale, merged["parameter_correlation"])
        return Track(values, sigma, scaled, covariance, merged["nis"], merged["flagged"])

    def _run(self, flight: Flight) -> Columns:
        columns = flight.firmware if self.flies_in(flight.scenario) else self._replayed(flight)
        return columns | {"flagged": is_flagged(columns["faults"], DO_NOT_TRUST).astype(np.float64)}

    def flies_in(self, scenario: Scenario) -> bool:
        """Return whether the scenario has this estimator in the loop."""
        return scenario.config.choices["estimator"] == self.name

    def _replayed(self, flight: Flight) -> Columns:
        """To the bit what it would have said in flight, as dither does not depend on the estimator."""
        scenario = flight.scenario
        config = Config(**{**scenario.config.choices, "estimator": self.name}, settings=scenario.settings)
        time_us = np.arange(len(flight.measured["theta"]), dtype=np.int64) * round(scenario.period * 1e6)
        return run_samples(config, {"time_us": time_us, **flight.measured}, flight.at)


_TAKEN = (
    *("parameter", "parameter_sigma", "parameter_correlation", "nis", "flagged"),
    *("natural_frequency", "natural_frequency_sigma", "damping_ratio", "damping_ratio_sigma"),
)


class Published(Entrant):
    """A baseline of the comparison, given the noise, walk and first guess of the scenario's settings."""

    def __init__(self, name: str, cost: float) -> None:
        self.name, self.title = name, BASELINES[name].title
        self.cost = cost

    def unfit(self, scenario: Scenario) -> str:
        """Return why the baseline cannot be run: its model, the preload, or dropouts; empty if it can."""
        if scenario.config.choices["model"] not in KINDS:
            return f"has no model {scenario.config.choices['model']!r}"
        if scenario.config.choices["preload"] != "trim":
            return "needs preload trim here: where a lever with preload fixed rests depends on what is estimated"
        return "needs every sample, and this scenario has dropouts" if scenario.sensors.dropout else ""

    def track(self, flights: Sequence[Flight]) -> Track:
        """Return the baseline's estimates from the detrended measurements of all flights at once."""
        batch = _batch(flights)
        with np.errstate(all="ignore"):  # of runs that break down
            estimates = BASELINES[self.name].run(batch, flights[0].at)
            return _of_estimates(batch, estimates)


def _batch(flights: Sequence[Flight]) -> Batch:
    config = flights[0].scenario.config
    y, u = (
        np.stack([beside(flights, name) for name in names], axis=-1)
        for names in (("theta", "theta_dot"), ("z_ddot", "tau_m"))
    )
    nothing = Truth(np.empty(0), None, np.empty(0))
    return measured(config.settings, config.choices["model"], config.choices["preload"], (y, u), nothing)


def _of_estimates(batch: Batch, estimates: Estimates) -> Track:
    parameters, positive = batch.knowledge.physical(estimates.w), batch.knowledge.positive
    dynamics = batch.model.dynamics(np.moveaxis(parameters, -1, 0), batch.rest(estimates.at))
    values = np.concatenate((parameters, np.moveaxis(dynamics, 0, -1)), axis=-1)
    scaled = np.log(parameters) if positive else parameters
    if estimates.covariance is None:
        return Track(values, np.full_like(values, np.nan), scaled, None, estimates.nis)
    stated = np.sqrt(with_dynamics(estimates.covariance, dynamics_gradient(batch, estimates.at, estimates.w)))
    scale = np.ones(PARAMETERS) if positive else batch.knowledge.sigma  # of `scaled` by w
    size = np.abs(values)
    if not positive:
        size[..., :PARAMETERS] = scale
    return Track(values, stated * size, scaled, estimates.covariance * scale[:, None] * scale, estimates.nis)


FIRMWARE = ("dual", "joint")

ENTRANTS: Mapping[str, Entrant] = {
    entrant.name: entrant
    for entrant in (
        *(Firmware(name) for name in FIRMWARE),
        Published("dual_ekf", 0.03),
        Published("joint_ekf", 0.03),
        Published("joint_ukf", 0.05),
        Published("rls", 0.05),
        Published("rls_regularised", 0.05),
        Published("lms", 0.05),
    )
}
"""By name."""
