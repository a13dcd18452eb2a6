"""A scenario with one seed as a file that c/pilot_fmu.c reads: loop_t, and the arrays that its pointers point to."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import Any

import numpy as np
from lever_cdkf.firmware.library import ffi
from lever_cdkf.numeric.arrays import FloatArray

from ..fast.closed_loop import Loop
from ..scenarios import inputs as scenario_inputs
from ..scenarios.scenario import Scenario

_MAGIC = 0x54554C4950554D46
_MEMBERS = ("plant", "cabin", "sensor", "base", "no_lever", "no_base", "torque", "signal")
"""Of loop_t: those with arrays that the pilot's side reads."""


def truths(scenario: Scenario) -> list[str]:
    """Return names of the true values that a pilot has, in the order of the columns."""
    truth = scenario_inputs.prepare(scenario).truth
    return [*truth.parameters, *vars(truth.dynamics)]


def packed(scenario: Scenario) -> bytes:
    """Return the content of the file. Raise LeverError for a pilot whose plant the C does not have."""
    inputs = scenario_inputs.prepare(scenario)
    loop = Loop(scenario, inputs, by_frames=True, every=len(inputs.time))
    truth = [*inputs.truth.parameters.values(), *vars(inputs.truth.dynamics).values()]
    columns = [_dither(scenario, inputs.time), inputs.z_ddot, *truth]
    arrays = {int(ffi.cast("uintptr_t", each)): bytes(ffi.buffer(each)) for each in loop.struct.kept()}
    blocks: dict[int, int] = {}
    pointers = []
    for offset, address in _pointers(loop.struct.pointer):
        pointers.append((offset, blocks.setdefault(address, len(blocks))))
    content = [arrays[address] for address in blocks]
    content += [
        np.ascontiguousarray(np.broadcast_to(column, inputs.time.shape), np.float64).tobytes() for column in columns
    ]
    image = bytes(ffi.buffer(loop.struct.pointer))
    head = struct.pack("<4Q", _MAGIC, len(image), len(pointers), len(content))
    table = b"".join(struct.pack("<2Q", *pointer) for pointer in pointers)
    sizes = struct.pack(f"<{len(content)}Q", *map(len, content))
    return head + table + sizes + b"".join(_padded(each) for each in (image, *content))


def _padded(data: bytes) -> bytes:
    return data + bytes(-len(data) % 8)


def _dither(scenario: Scenario, time: FloatArray) -> FloatArray:
    """Return what the estimator is asked for at each sample [N m]."""
    asked = np.zeros_like(time)
    for sample, values in sorted(scenario_inputs.commands(scenario, time).items()):
        if "dither_rms" in values:
            asked[sample:] = values["dither_rms"]
    return asked


def _pointers(loop: Any) -> Iterator[tuple[int, int]]:
    """Yield offset in loop_t, and address, of each pointer to an array that is not NULL."""
    fields = dict(ffi.typeof("loop_t").fields)
    for name in _MEMBERS:
        yield from _pointers_in(getattr(loop, name), fields[name].type, fields[name].offset)


def _pointers_in(value: Any, kind: Any, offset: int) -> Iterator[tuple[int, int]]:
    if kind.kind == "pointer" and value != ffi.NULL:
        yield offset, int(ffi.cast("uintptr_t", value))
    elif kind.kind == "array" and kind.item.kind in ("array", "pointer", "struct"):
        for index in range(kind.length):
            yield from _pointers_in(value[index], kind.item, offset + index * ffi.sizeof(kind.item))
    elif kind.kind == "struct":
        for name, field in kind.fields:
            yield from _pointers_in(getattr(value, name), field.type, offset + field.offset)
