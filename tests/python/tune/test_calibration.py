"""Gain, delay and friction that a log is known to have, and what is said where they cannot be known."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
from lever_cdkf.firmware.settings_file import Assignments
from lever_cdkf.numeric.arrays import Array
from lever_cdkf.tune import recording
from lever_cdkf.tune.calibration import NAMES, Calibrated, calibrate
from lever_cdkf.tune.likelihood import Likelihood
from lever_cdkf.tune.recording import Recording
from python.tune.conftest import NOISE, Simulate

WITHIN = (0.01, 0.3e-3, 0.03)
"""What the error of each of NAMES may be."""
TRUTH = (1.025, 2.2e-3, 0.12)


@pytest.fixture(scope="module")
def wrong(simulate: Simulate) -> Recording:
    """Return a minute with the calibration TRUTH."""
    gain, delay, friction = TRUTH
    return recording.read([simulate(60.0, gain_error=gain - 1.0, delay=delay, friction=friction)])


@pytest.mark.parametrize("start", [{}, {name: 2.0 * value for name, value in NOISE.items()} | {"z_ddot_delay": 5e-3}])
def test_it_is_found_wherever_the_search_starts(wrong: Recording, start: dict[str, float]) -> None:
    """Noise that is set wrong, by a factor of two both ways, must not look like a gain."""
    steps: list[tuple[int, int, str]] = []
    likelihood = Likelihood(wrong, held_out=0.0)
    likelihood.progress = lambda *step: steps.append(step)
    found = calibrate(likelihood, start).entries
    assert [step[0] for step in steps] == sorted(step[0] for step in steps)
    assert all(0 < done < total for done, total, _ in steps)
    assert [entry.name for entry in found] == list(NAMES)
    for entry, true, within in zip(found, TRUTH, WITHIN, strict=True):
        assert abs(entry.best - true) < min(within, 3.0 * entry.sigma), entry
        assert entry.verdict == "found"


@pytest.mark.parametrize(
    ("torque", "settings", "words"),
    [
        (0.16, {}, "without dither they cannot be known"),
        (1.0, {"model": "linear_physical"}, "with model linear_physical they cannot be known"),
        (0.2, {"excitation_least": 10.0}, "the lever hardly moves"),
    ],
)
def test_what_cannot_be_known_stays(
    torque: float, settings: dict[str, float | str], words: str, steady_log: Path
) -> None:
    """With so much of the torque of a log, whose dither of 0.3 N m is more than DITHER_LEAST by a factor of six."""
    recorded = recording.read([steady_log])
    recorded.samples["tau_m"] *= torque
    calibration = calibrate(Likelihood(recorded), settings)
    assert (calibration.entries, calibration.assignments) == ((), {})
    assert f"lever_friction stay as they are: {words}" in calibration.text


def test_torque_that_nobody_knows_is_not_taken_for_it(simulate: Simulate) -> None:
    calibration = calibrate(Likelihood(recording.read([simulate(21.0, tremor=0.3)]), held_out=0.0), {})
    assert calibration.assignments == {}
    assert {entry.verdict for entry in calibration.entries} == {"kept: innovations not white"}
    assert calibration.text.startswith("The calibration stays as it is: the innovations are not white")


@pytest.mark.parametrize(
    ("best", "sigma", "white", "after", "sigma_after"),
    [
        (1.03, 0.005, True, 1.03, 0.005),
        (1.03, 0.03, True, 1.0, 0.02),  # known better before
        (1.10, 0.03, True, 1.0, 0.02),
        (1.12, 0.03, True, 1.12, 0.03),  # but contradicted: by more than three of both standard deviations
        (1.03, 0.005, False, 1.0, 0.02),
    ],
)
def test_decision(best: float, sigma: float, white: bool, after: float, sigma_after: float) -> None:
    entry = Calibrated("z_ddot_gain", before=1.0, sigma_before=0.02, best=best, sigma=sigma, white=white)
    assert (entry.after, entry.sigma_after) == (after, sigma_after)
    assert entry.assignments == ({"z_ddot_gain": after, "z_ddot_gain_sigma": sigma_after} if after != 1.0 else {})


def test_a_delay_is_undone_across_what_is_missing(wrong: Recording) -> None:
    """A sine of 5 Hz, a tenth of it not valid."""
    samples = wrong.samples[:2000].copy()
    recorded = dataclasses.replace(wrong, samples=samples)
    omega, delay = 10.0 * math.pi, 2.4e-3
    samples["z_ddot"] = np.sin(omega * (recorded.time - delay))
    samples["z_ddot_valid"] = np.arange(len(samples)) % 10 != 3
    samples["z_ddot"][~samples["z_ddot_valid"]] = np.nan
    undone = recorded.without_delay(delay)
    assert (undone["z_ddot_valid"] == samples["z_ddot_valid"]).all()
    assert np.abs(undone["z_ddot"] - np.sin(omega * recorded.time))[:-5].max() < 1e-3


def test_what_is_not_known_of_the_torque_is_part_of_the_gain(steady_log: Path) -> None:
    """Divide the lever's equation by the gain of the torque, 1 + e. An arm lighter by e M / l^2 has the inertia M then,
    and its first moment is less by e M / l instead of e l mu. The gain of the accelerometer makes up for it."""
    likelihood = Likelihood(recording.read([steady_log]), held_out=0.0)
    m_p, own, first_moment, length, inertia, e = 2.8, 0.25 * 1.2, 0.5 * 1.2, 0.45, 0.020, 0.07
    share = 1.0 - (length**2 * (own + m_p) + inertia) / (length**2 * (first_moment + m_p))
    kept = ("z_ddot_delay", "lever_friction", *NOISE)
    alone, beside = (calibrate(likelihood, {**NOISE, "tau_m_gain_sigma": s}, kept).entries[0] for s in (0.0, e))
    assert beside.best == alone.best
    assert math.sqrt(beside.sigma**2 - alone.sigma**2) == pytest.approx(share * e, rel=0.2)


def test_a_change_seen_with_more_torque_alone_is_no_information(
    steady_log: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Otherwise the standard deviations would not have that of the torque's gain in them."""
    kept = ("z_ddot_delay", "lever_friction", *NOISE)

    def sigma() -> float:
        likelihood = Likelihood(recording.read([steady_log]), held_out=0.0)
        return calibrate(likelihood, {**NOISE, "tau_m_gain_sigma": 0.07}, kept).entries[0].sigma

    def jumps(likelihood: Likelihood, assignments: Assignments, delay: float = 0.0) -> Array:
        innovations = run(likelihood, assignments, delay)
        if float(assignments.get("tau_m_gain", 1.0)) > 1.0:
            innovations["log_likelihood"][10_000:10_050] -= 20.0
        return innovations

    undisturbed, run = sigma(), Likelihood.run
    monkeypatch.setattr(Likelihood, "run", jumps)
    assert sigma() == pytest.approx(undisturbed, rel=0.1)
