"""`budget quick`: one model and one estimator in a few seconds, while the firmware is being changed."""

from __future__ import annotations

import argparse

from lever_cdkf.cli.tables import Row, print_tables

from . import image, measure, sizes, trace
from .recording import record


def run(args: argparse.Namespace) -> int:
    """Return the command. Raise LeverError."""
    elf = image.build(args.build, args.firmware, args.flags)
    recording = record(args.model)
    time = measure.sample_times(recording)
    rows: list[Row] = []
    for form in image.FORMS:
        run = image.run(elf, recording, args.model, args.estimator, form)
        traced = trace.trace(elf, recording, args.model, args.estimator, form, trace.INIT, len(time) - 1)
        for what, spent in (("instructions", run.instructions), ("cycles", traced.cycles[1:])):
            rows.append({"measured": f"{form}, {what}", **vars(measure.Count.of(spent, run, time))})
    blank = dict.fromkeys(rows[0], None)
    gap = measure.after_gap(elf, args.model, args.estimator)
    for name, init, most in (("instructions", run.init, gap[0]), ("cycles", int(traced.cycles[0]), gap[1])):
        rows.append({**blank, "measured": f"update after a gap, {name}", "worst": most})
        rows.append({**blank, "measured": f"init, {name}", "worst": init})
    memory: Row = {"text": sizes.of_core(elf)["text"], **sizes.of_instance(elf)}
    print_tables({f"{args.estimator}, {args.model}": rows, "Bytes": [memory]}, args.json)
    return 0
