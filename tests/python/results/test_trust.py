"""What a reader is told first: whether to trust the estimates, why not, and what to do."""

from __future__ import annotations

import numpy as np
import pytest
from lever_cdkf.firmware.estimator import TEST_RATIOS
from lever_cdkf.firmware.library import enum_names
from lever_cdkf.results import trust
from lever_cdkf.results.ratios import behind_calibration
from quality import definitions


def test_a_run_that_is_flagged_throughout_is_not_to_be_trusted() -> None:
    said = trust.warning({"calibration": 0.998, "change": 0.1}, 0.998)
    words = "the inputs, or their times, do not agree: one is wrong or wrongly scaled"
    how = "set publish_test_ratios=1 to see the evidence"
    assert said == f"Do not trust the estimates: {words} (99.8 % of the time; {how})."


def test_a_part_that_is_flagged_is_named() -> None:
    assert trust.warning({"theta": 0.1}, 0.1).startswith("Do not trust the estimates 10 % of the time: theta missing")


@pytest.mark.parametrize(("shares", "warned"), [({}, 0.0), ({"change": 1.0}, 0.0), ({"theta": 0.01}, 0.01), ({}, None)])
def test_without_a_warning_nothing_is_said(shares: dict[str, float], warned: float | None) -> None:
    assert trust.warning(shares, warned) == ""
    assert trust.next_step(shares, "lever tune x.log") == ""


@pytest.mark.parametrize(
    ("shares", "step"),
    [
        ({"calibration": 1.0}, "lever tune x.log"),
        ({"base": 0.9, "mismatch": 0.9}, "check sign, unit and gravity of z_ddot"),
        ({"theta": 0.03, "mismatch": 0.9}, "lever tune x.log"),
    ],
)
def test_the_next_step_is_that_of_the_first_great_cause(shares: dict[str, float], step: str) -> None:
    """A cause, such as a base that is wrong, before what follows from it; a passing one does not decide."""
    assert trust.next_step(shares, "lever tune x.log") == step


@pytest.mark.parametrize(
    ("evidence", "words", "step"),
    [
        ({}, "", "tune"),
        ({"calibration": 5}, "evidence: calibration", "tune"),
        ({"calibration": 2, "clock": 5}, "evidence: clock, calibration", "check the time of the samples"),
        ({"torque_gain": 1}, "evidence: torque gain", "check the gain of the torque sensor"),
    ],
)
def test_of_calibration_the_evidence_is_named_and_decides_what_to_do(
    evidence: dict[str, float], words: str, step: str
) -> None:
    shares = {"calibration": 0.5}
    said = trust.warning(shares, 0.5, evidence)
    assert said.endswith(f" (50 % of the time{f'; {words}' if words else ''}).")
    assert trust.next_step(shares, "tune", evidence).startswith(step)


def test_the_evidence_of_calibration_is_that_of_the_firmware() -> None:
    shown = {name for name, _, _, fault, _ in definitions.rows("evidence") if fault == "calibration"}
    assert set(trust.EVIDENCE) == shown
    assert shown < set(TEST_RATIOS)


def test_evidence_counts_while_calibration_shows_and_is_judged() -> None:
    bit = next(bit for bit, name in enum_names("lever_fault").items() if name == "calibration")
    clock, torque, noise = map(TEST_RATIOS.index, ("clock", "torque_gain", "noise"))
    evidence = np.array([clock, clock, clock, torque, noise, torque, clock, np.nan])
    trace = {
        "evidence": evidence,
        "test_ratio": np.array([1.2, 1.2, 1.2, 1.1, 3.0, 0.9, 1.2, np.nan]),
        "faults": np.array([bit, bit + 1, 0, bit, bit, bit, bit, np.nan]),
    }
    judged = np.arange(8) != 6
    assert behind_calibration(trace, judged) == {"clock": 2, "torque_gain": 1}
    assert behind_calibration({"faults": trace["faults"]}, judged) is None
