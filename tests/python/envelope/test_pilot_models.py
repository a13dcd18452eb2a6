"""Models of the firmware for pilots who are no arm on a rigid seat: right about θ/z̈ where the lever's model is not."""

from __future__ import annotations

import pytest
from lever_sil.envelope import run_conditions
from lever_sil.envelope.conditions import CONDITIONS


@pytest.mark.parametrize("name", ["two_dof_seat", "mayo_random_hand"])
def test_the_model_of_such_a_pilot_needs_no_flag(name: str) -> None:
    (result,) = run_conditions.run([CONDITIONS[name]], {}, 2, lambda *_: None)
    assert all(limit.holds(result.of(limit)) for limit in CONDITIONS[name].limits)
