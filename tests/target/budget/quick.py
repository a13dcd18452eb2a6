"""`budget quick`: one model and one estimator in a few seconds, while the firmware is being changed."""

from __future__ import annotations

import argparse

from lever_cdkf.host_tools.tables import Row, print_tables

from . import image, measure, sizes
from .recording import record


def run(args: argparse.Namespace) -> int:
    """The command. Raises LeverError."""
    elf = image.build(args.build, args.firmware, args.flags)
    recording = record(args.model)
    rows: list[Row] = []
    for form in image.FORMS:
        measured = image.run(elf, recording, args.model, args.estimator, form)
        rows.append({"measured": form, **vars(measure.Count.of(measured, measure.sample_times(recording)))})
    blank = dict.fromkeys(rows[0], None)
    gap = measure.after_gap(elf, args.model, args.estimator)
    rows.append({**blank, "measured": "update, after a gap", "worst": gap})
    rows.append({**blank, "measured": "init", "worst": measured.init})
    memory: Row = {"text": sizes.of_core(elf)["text"], **sizes.of_instance(elf)}
    print_tables({f"Instructions, {args.estimator}, {args.model}": rows, "Bytes": [memory]}, args.json)
    return 0
