"""What the estimator costs on a Cortex-M4F stays within the limits it was given, and near what was accepted last."""

from __future__ import annotations

import copy
import os
from collections.abc import Callable
from typing import Any

import pytest
from target.budget import golden, report

pytestmark = pytest.mark.requires("arm-none-eabi-gcc", "qemu-system-arm")


def test_its_tables_fit_on_a_page(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "environ", {name: value for name, value in os.environ.items() if name != "COLUMNS"})
    row = {"function": "lever_update", "stack [bytes]": 1000, "deepest chain": " > ".join(["filter/cdkf.c:move"] * 20)}
    monkeypatch.setattr(report, "tables", lambda _: {"Stack by function": [row, row]})
    report.show({})
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 120
    assert sum(line.count("filter/cdkf.c:move") for line in lines) == 40


@pytest.mark.requirement("R48")
def test_limits_hold(budget: dict[str, Any], record_property: Callable[[str, object], None]) -> None:
    numbers = golden.numbers(budget)
    for name, limit in golden.LIMITS.items():
        record_property(name, f"{numbers[name]:g} of {limit}")
    beyond = golden.beyond_limits(budget)
    assert not beyond, "\n".join(beyond)


@pytest.mark.requirement("R48")
def test_nothing_is_dearer_than_what_was_accepted(budget: dict[str, Any]) -> None:
    accepted = golden.load()
    if not golden.is_comparable(budget, accepted):
        pytest.skip(f"the golden values are of {accepted['compiler']}, and this is {budget['compiler']}")
    worse = golden.regressions(budget, accepted)
    assert not worse, "\n".join(worse)


def test_cycles_are_counted_of_the_same_calls(budget: dict[str, Any]) -> None:
    assert budget["cycles"].keys() == budget["instructions"].keys()
    counted = golden.numbers(budget)
    for name, instructions in counted.items():
        if name.startswith("instructions"):
            assert 1.4 < counted[name.replace("instructions", "cycles", 1)] / instructions < 2.2, name
    assert 1.2 < counted["init.cycles"] / counted["init.instructions"] < 2.5  # mostly integers: memory is cleared


def test_a_gap_is_bounded(budget: dict[str, Any]) -> None:
    """One call predicts at most 12 times: app/prediction.c."""
    for estimator, most in budget["instructions_after_gap"].items():
        entry = budget["instructions"][estimator]["lever"]
        assert entry["worst"] < most < 16 * entry["mean"]


# --- the checks bite: values changed by hand ---


@pytest.fixture
def accepted(budget: dict[str, Any]) -> dict[str, Any]:
    """Return the budget itself as golden values."""
    return {"compiler": budget["compiler"], "values": golden.numbers(budget)}


@pytest.mark.parametrize(
    "name", ["instructions.joint.linear_physical.worst", "instructions.tick.dual.lever.mean", "stack_bytes"]
)
def test_a_regression_is_told_from_noise(budget: dict[str, Any], accepted: dict[str, Any], name: str) -> None:
    accepted["values"][name] /= 1.019
    assert golden.regressions(budget, accepted) == []
    accepted["values"][name] /= 1.004
    (line,) = golden.regressions(budget, accepted)
    assert line.startswith(
        f"{name}: {accepted['values'][name]:g} before, {golden.numbers(budget)[name]:g} now (+2.3 %)"
    )
    assert golden.ACCEPT in line


def test_a_value_cannot_come_or_go_unnoticed(budget: dict[str, Any], accepted: dict[str, Any]) -> None:
    del accepted["values"]["instance_bytes"]
    accepted["values"]["instructions.dual.other.mean"] = 1.0
    gone, new = golden.regressions(budget, accepted)
    assert new.startswith("instructions.dual.other.mean: gone") or gone.startswith("instructions.dual.other.mean: gone")
    assert new.startswith("instance_bytes: new") or gone.startswith("instance_bytes: new")


def test_each_limit_is_looked_at(budget: dict[str, Any]) -> None:
    for name, limit in golden.LIMITS.items():
        changed = copy.deepcopy(budget)
        place = changed
        *path, last = name.split(".")
        for key in path:
            place = place[key]
        place[last] = limit
        assert not [line for line in golden.beyond_limits(changed) if line.startswith(f"{name} is")]
        place[last] = limit + 1
        assert [line for line in golden.beyond_limits(changed) if line.startswith(f"{name} is {limit + 1:g}")]


def test_joint_is_held_to_dual(budget: dict[str, Any]) -> None:
    changed = copy.deepcopy(budget)
    means = {model: entry["mean"] for model, entry in changed["instructions"]["dual"].items()}
    for model, mean in means.items():
        changed["instructions"]["joint"][model]["mean"] = 1.0199 * mean
    assert not [line for line in golden.beyond_limits(changed) if line.startswith("joint")]
    changed["instructions"]["joint"]["linear_physical"]["mean"] = 1.0211 * means["linear_physical"]
    (line,) = [line for line in golden.beyond_limits(changed) if line.startswith("joint")]
    assert line.startswith("joint linear_physical: the mean is 1.021 times that of dual")
