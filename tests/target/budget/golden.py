"""The budget against the limits it was promised to keep, and against the values that were accepted last."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from lever_cdkf.runtime.files import write_text

GOLDEN = Path(__file__).with_name("golden.json")
TOLERANCE = 0.02
"""Of a golden value: what is more is a regression, and needs to be accepted."""
ACCEPT = "cmake --build build --target budget-accept"

LIMITS = {
    "instructions.dual.lever.mean": 2775,
    "instructions.dual.lever.worst": 8850,
    "instructions.dual.lever.start_up_worst": 8100,
    "instructions.tick.dual.lever.mean": 4175,
    "instructions.bounce.dual.lever.mean": 3860,
    "instructions_after_gap.dual": 20000,
    "cycles.dual.lever.mean": 4325,
    "init.instructions": 100_000,
    "text_bytes": 42 << 10,
    "memory_bytes": 2464,
    "stack_bytes": 1 << 10,
    "data_bytes": 0,
    "bss_bytes": 0,
}
JOINT_TO_DUAL = 1.02
"""Greatest ratio of the mean instructions, of every model."""

_COUNTED = ("mean", "worst", "start_up_worst")
_WHOLE = ("instructions_after_gap", "cycles_after_gap", "init")
_BYTES = (
    "text_bytes",
    "rodata_bytes",
    "recorder_bytes",
    "data_bytes",
    "bss_bytes",
    "instance_bytes",
    "memory_bytes",
    "stack_bytes",
)


def numbers(budget: dict[str, Any]) -> dict[str, float]:
    """Return what is compared, by the path in budget.json: "instructions.dual.lever.mean"."""
    found: dict[str, float] = {}

    def walk(entry: dict[str, Any], path: str) -> None:
        for key, value in entry.items():
            if isinstance(value, dict):
                walk(value, f"{path}.{key}")
            elif key in _COUNTED or path in _WHOLE:
                found[f"{path}.{key}"] = value

    for part in ("instructions", "cycles", *_WHOLE):
        walk(budget[part], part)
    stack = {f"stack.{name}": entry["bytes"] for name, entry in budget["stack"].items() if entry["bytes"] > 0}
    return found | {name: budget[name] for name in _BYTES} | stack


def beyond_limits(budget: dict[str, Any]) -> list[str]:
    """Return a line for each limit that does not hold."""
    found = numbers(budget)
    lines = [
        f"{name} is {found[name]:g}: at most {limit} is allowed"
        for name, limit in LIMITS.items()
        if found[name] > limit
    ]
    for model, joint in budget["instructions"]["joint"].items():
        ratio = joint["mean"] / budget["instructions"]["dual"][model]["mean"]
        if ratio > JOINT_TO_DUAL:
            lines.append(
                f"joint {model}: the mean is {ratio:.3f} times that of dual: at most {JOINT_TO_DUAL} is allowed"
            )
    return lines


def load() -> dict[str, Any]:
    """Return the accepted values: {"compiler": …, "values": {path: number}}."""
    content: dict[str, Any] = json.loads(GOLDEN.read_text(encoding="utf-8"))
    return content


def accept(budget: dict[str, Any]) -> None:
    """Make this budget the golden one."""
    content = {"compiler": budget["compiler"], "values": numbers(budget)}
    write_text(GOLDEN, json.dumps(content, indent=4) + "\n")


def is_comparable(budget: dict[str, Any], golden: dict[str, Any]) -> bool:
    """Return whether both are of the same compiler; another one's code is neither a regression nor an improvement."""
    return bool(budget["compiler"] == golden["compiler"])


def regressions(budget: dict[str, Any], golden: dict[str, Any]) -> list[str]:
    """Return a line for each value that is more than TOLERANCE above the golden one, or that only one of the two
    has."""
    new, old = numbers(budget), golden["values"]
    lines = [
        f"{name}: {old[name]:g} before, {new[name]:g} now ({_percent(old[name], new[name])}); {ACCEPT} accepts it"
        for name in new.keys() & old.keys()
        if new[name] > old[name] * (1.0 + TOLERANCE)
    ]
    lines += [f"{name}: {'new' if name in new else 'gone'}; {ACCEPT} accepts it" for name in new.keys() ^ old.keys()]
    return sorted(lines)


def improvements(budget: dict[str, Any], golden: dict[str, Any]) -> list[str]:
    """Return a line for each value that is so much below the golden one that this should be made to stay."""
    new, old = numbers(budget), golden["values"]
    return sorted(
        f"{name}: {old[name]:g} before, {new[name]:g} now ({_percent(old[name], new[name])}); {ACCEPT} keeps it"
        for name in new.keys() & old.keys()
        if new[name] < old[name] * (1.0 - TOLERANCE)
    )


def _percent(old: float, new: float) -> str:
    return f"{100.0 * (new / old - 1.0):+.1f} %" if old else "none before"
