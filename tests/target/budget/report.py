"""`budget table`: measures, prints, writes budget.json, and judges."""

from __future__ import annotations

import argparse
import json
import os
import sys
from pathlib import Path
from typing import Any

from lever_cdkf.cli.progress import Progress
from lever_cdkf.cli.tables import Row, Tables, print_tables
from lever_cdkf.runtime.files import write_text

from . import golden, guide, image, measure, port_sizes


def run(args: argparse.Namespace) -> int:
    """Return the command. Raise LeverError."""
    elf = image.build(args.build, args.firmware, args.flags)
    with Progress("budget") as progress:
        runs = measure.run_all(elf, progress.show)
        budget = measure.budget(elf, args.firmware, runs, progress.show)
    show(budget)
    if args.json is not None:
        write_text(args.json, json.dumps(budget, indent=2) + "\n")
    if args.accept:
        _accept(budget, args.images)
    return _judge(budget) if args.check else 0


def _accept(budget: dict[str, Any], images: Path) -> None:
    """Make this the golden values, and what the porting guide says. Raise LeverError."""
    sizes = {name: port_sizes.of_port(name, guide.port_image(images, name)) for name in port_sizes.TRANSPORTS}
    golden.accept(budget)
    values = golden.load()["values"]
    guide.update(
        {"instructions": guide.instructions(values), "memory": guide.memory(values), "port": guide.port(sizes)}
    )
    print(f"accepted: {golden.GOLDEN} and {guide.GUIDE}")


def _judge(budget: dict[str, Any]) -> int:
    """Say what does not hold; the exit status."""
    accepted = golden.load()
    complaints = golden.beyond_limits(budget)
    if golden.is_comparable(budget, accepted):
        complaints += golden.regressions(budget, accepted)
        for line in golden.improvements(budget, accepted):
            print(f"budget: better: {line}")
    else:
        print(f"budget: not compared with the golden values, which are of {accepted['compiler']}")
    for line in complaints:
        print(f"budget: {line}", file=sys.stderr)
    return 1 if complaints else 0


def show(budget: dict[str, Any]) -> None:
    """Print the budget; where there is no terminal, chains of calls are folded at the width of a page."""
    if not sys.stdout.isatty():
        os.environ.setdefault("COLUMNS", "120")
    print_tables(tables(budget))


def tables(budget: dict[str, Any]) -> Tables:
    """Return the budget as it is printed."""
    calibration = budget["calibration"]
    measured: list[Row] = [
        {"how": "processor", "what": budget["processor"]},
        {"how": "compiler", "what": budget["compiler"]},
        {
            "how": f"loop of {calibration['loop_instructions']} instructions",
            "what": f"{calibration['loop_measured']:.0f}",
        },
        {"how": "subtracted for measuring", "what": str(calibration["overhead_subtracted"])},
    ]
    memory = [
        {"what": what, "bytes": budget[name], "limit [bytes]": golden.LIMITS.get(name)} for name, what in _BYTES.items()
    ]
    stack = [
        {"function": name, "stack [bytes]": entry["bytes"], "deepest chain": " > ".join(entry["chain"])}
        for name, entry in budget["stack"].items()
    ]
    model = [{"instruction": what, "cycles": str(cost)} for what, cost in budget["cycle_model"].items()]
    files = [{"file": file, "text": size} for file, size in budget["files"].items()]
    return {
        "How it was measured": measured,
        "Instructions and cycles a sample": _spent(budget),
        "Model of the cycles": model,
        "Memory": memory,
        "Code by file [bytes]": files,
        "Stack by function": stack,
    }


_BYTES = {
    "text_bytes": "code of the core (.text)",
    "rodata_bytes": "constants of the core (.rodata)",
    "recorder_bytes": "the recorder, where it is used (.text, .rodata)",
    "data_bytes": "variables of the core (.data)",
    "bss_bytes": "variables of the core (.bss)",
    "instance_bytes": "an instance",
    "memory_bytes": "lever_memory_t",
    "stack_bytes": "stack, worst case of the call graph",
    "stack_painted_bytes": "stack, seen to be written in the runs",
}


def _spent(budget: dict[str, Any]) -> list[Row]:
    rows: list[Row] = []
    whats = {"update": "lever_update()", "tick": "whole tick", "bounce": "lever_update(), aircraft and mitigation"}
    for form, what in whats.items():
        is_update = form == "update"
        instructions, cycles = (
            budget[each] if is_update else budget[each][form] for each in ("instructions", "cycles")
        )
        for estimator in image.ESTIMATORS:
            for model, entry in instructions[estimator].items():
                operations = budget["floating_point_operations"][estimator][model] if is_update else {}
                rows.append(
                    {
                        "measured": what,
                        "estimator": estimator,
                        "model": model,
                        "mean": entry["mean"],
                        "median": entry["median"],
                        "worst": entry["worst"],
                        "at [s]": entry["worst_s"],
                        f"worst before {measure.START_UP_S:g} s": entry["start_up_worst"],
                        "cycles, mean": cycles[estimator][model]["mean"],
                        "cycles, worst": cycles[estimator][model]["worst"],
                        "floating-point operations": operations.get("mean"),
                        "instructions / operation": operations.get("instructions_per_operation"),
                    }
                )
    blank = dict.fromkeys(rows[0], None)
    gap = f"after a gap of {measure.GAP_S[1] - measure.GAP_S[0]:.1f} s"
    for estimator, most in budget["instructions_after_gap"].items():
        cost = {"worst": most, "cycles, worst": budget["cycles_after_gap"][estimator]}
        rows.append({**blank, "measured": gap, "estimator": estimator, "model": "lever", **cost})
    once = {"worst": budget["init"]["instructions"], "cycles, worst": budget["init"]["cycles"]}
    rows.append({**blank, "measured": "lever_init()", **once})
    return rows
