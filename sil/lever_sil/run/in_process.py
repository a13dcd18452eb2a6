"""A run against the firmware in this process: the Recording that loop.run() makes over a LeverBus, from the C loop."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields

import numpy as np
from lever_cdkf.can import codec
from lever_cdkf.can.bus import LeverBus
from lever_cdkf.can.commander import refusal, result_of
from lever_cdkf.can.identity import Identity

from ..fast import closed_loop, plants
from ..fast.closed_loop import BusFrames
from ..scenarios.inputs import Inputs, prepare
from ..scenarios.scenario import Scenario
from . import loop
from .loop import Progress, Recording


def run(
    scenario: Scenario, channel: str = "lever", progress: Progress | None = None, snapshots: float | None = None
) -> Recording:
    """Run `scenario`; a pilot whose plant the C does not have runs in Python.

    `channel` names the estimator in errors, which sends its state each `snapshots` seconds.

    Raise NoAnswerError when the firmware falls silent, RefusedError when it refuses a COMMAND.
    """
    inputs = prepare(scenario)
    if plants.has(inputs.truth):
        where = f"the firmware in this process, channel {channel!r}"
        return _run_in_c(scenario, inputs, where, progress, snapshots)
    with LeverBus(channel, config=scenario.config, aircraft=scenario.known_aircraft, snapshots=snapshots) as bus:
        return loop.run(scenario, bus, progress=progress)


def _run_in_c(
    scenario: Scenario, inputs: Inputs, where: str, progress: Progress | None, snapshots: float | None
) -> Recording:
    count = len(inputs.time)
    run = closed_loop.Loop(scenario, inputs, by_frames=True, every=count)
    run.keep_frames()
    run.watch(scenario.known_aircraft)
    if snapshots is not None:
        run.send_snapshots(snapshots)
    given = run.struct.pointer
    given.most_unanswered = loop.MOST_UNANSWERED
    parts, done = [], 0
    while done < count:
        done = run.advance(count)
        parts.append(run.take_frames())
        if given.refused:
            raise loop.RefusedError(f"{where}: {_refusal(parts[-1])}")
        if given.unanswered_in_a_row >= loop.MOST_UNANSWERED:
            raise loop.NoAnswerError(f"no STATE_ESTIMATE on {where} at sample {done - 1}")
        if progress is not None:
            progress(done, count)
    traffic = _joined(parts)
    theta, theta_dot, tau_m = (run.signals[name] for name in ("theta", "theta_dot", "tau_m"))
    identity = _identity(traffic)
    return Recording(scenario, inputs, traffic, theta, theta_dot, tau_m, given.unanswered, given.misplaced, identity)


def _joined(parts: Sequence[BusFrames]) -> BusFrames:
    return BusFrames(*(np.concatenate([getattr(part, each.name) for part in parts]) for each in fields(BusFrames)))


def _identity(traffic: BusFrames) -> Identity:
    identity, identifier = Identity(), codec.message("IDENTITY").frame_id
    for data in traffic.data[traffic.identifier == identifier]:
        identity.take(codec.decode(identifier, bytes(data))[1])
    return identity


def _refusal(traffic: BusFrames) -> str:
    """Return what the last COMMAND_ACK says."""
    acknowledged = traffic.data[traffic.identifier == codec.message("COMMAND_ACK").frame_id]
    fields = codec.decode_columns("COMMAND_ACK", acknowledged[-1:])
    return refusal(result_of({name: float(column[0]) for name, column in fields.items()}))
