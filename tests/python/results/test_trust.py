"""What a reader is told first: whether to trust the estimates, why not, and what to do."""

from __future__ import annotations

import pytest
from lever_cdkf.results import trust


def test_a_run_that_is_flagged_throughout_is_not_to_be_trusted() -> None:
    said = trust.warning({"calibration": 0.998, "change": 0.1}, 0.998)
    words = "the inputs, or their times, do not agree: one is wrong or wrongly scaled"
    assert said == f"Do not trust the estimates: {words} (99.8 % of the time)."


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
