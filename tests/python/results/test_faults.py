"""Which faults say not to trust the estimates, and how they are described: the header says so to every tool."""

from __future__ import annotations

import numpy as np
import pytest
from lever_cdkf.firmware.native import DO_NOT_TRUST, enum_names, enum_words, fault_names
from lever_cdkf.results.faults import FaultCounts

FAULTS = enum_names("lever_fault")


@pytest.mark.requirement("R57")
def test_faults_that_say_not_to_trust_the_estimates() -> None:
    expected = {"theta", "theta_dot", "torque", "base", "clock", "bound", "recovered", "hands_off"}
    expected |= {"innovation", "mismatch", "calibration"}
    assert set(fault_names(DO_NOT_TRUST)) == expected
    assert sum(FAULTS) & DO_NOT_TRUST == DO_NOT_TRUST


@pytest.mark.requirement("R57")
@pytest.mark.parametrize(("bit", "name"), FAULTS.items())
def test_samples_are_counted_by_these(bit: int, name: str) -> None:
    counts = FaultCounts()
    counts.add(np.array([0.0, float(bit), np.nan]))
    assert counts.shares == {name: 0.5}
    assert counts.warned_share == (0.5 if bit & DO_NOT_TRUST else 0.0)


def test_an_input_that_a_recording_lacks_does_not_count() -> None:
    counts = FaultCounts()
    counts.add(np.array([4.0, 12.0]), without=("torque",))
    assert (counts.shares, counts.warned_share) == ({"base": 0.5}, 0.5)


@pytest.mark.parametrize("enum", ["lever_fault", "lever_platform_fault", "lever_mode"])
def test_everything_that_is_shown_in_words_has_words(enum: str) -> None:
    words = enum_words(enum)
    assert list(words) == list(enum_names(enum).values())
    assert all(len(each) > 4 and "*/" not in each for each in words.values())
    assert len(set(words.values())) == len(words)
