"""Frames fed in bulk against the same frames through python-can's bus, one by one, on a log full of faults."""

from __future__ import annotations

from pathlib import Path

import can
import numpy as np
import pytest
from lever_cdkf.can import bulk, codec, fields
from lever_cdkf.can.bulk import Feeder
from lever_cdkf.can.bus import LeverBus
from lever_cdkf.can.estimator_frames import EstimatorFrames, read_samples
from lever_cdkf.can.logs import LogError, Recording
from lever_cdkf.firmware.estimator import Estimator, Health, run_samples
from python.conftest import Session

INPUTS = ("LEVER_SAMPLE", "BASE_SAMPLE", "COMMAND")


def spoilt(lines: list[str]) -> list[str]:
    """Return frames lost, doubled, swapped, corrupt and cut; other messages and other buses between them."""
    random = np.random.default_rng(4)
    damaged = []
    for line in lines:
        kind = random.integers(0, 60)
        if kind == 0:
            continue
        time, bus, frame, *_ = line.split()
        if kind == 1:
            line = f"{time} {bus} {frame[:-1]}{'0' if frame[-1] != '0' else '1'} T"
        if kind == 2:
            line = f"{time} {bus} {frame[:-4]} T"
        damaged.append(line)
        if kind == 3:
            damaged.append(line)
        if kind == 4:
            damaged.append(f"{time} other {frame}")
        if kind == 5:
            damaged.append(f"{time} {bus} 7A0#0011")
        if kind == 6:
            damaged.append(f"{time} {bus} 00000{frame}")
        if kind == 7 and len(damaged) > 1:
            damaged[-2:] = damaged[:-3:-1]
    return damaged


@pytest.fixture(scope="module")
def spoilt_log(session: Session, tmp_path_factory: pytest.TempPathFactory) -> Path:
    inputs = {f"{codec.message(name).frame_id:03X}" for name in INPUTS}
    lines = [line for line in session.lines if line.split()[2][:3] in inputs]
    log = tmp_path_factory.mktemp("spoilt") / "spoilt.log"
    log.write_text("".join(f"{line}\n" for line in spoilt(lines)))
    return log


def one_by_one(log: Path, session: Session) -> tuple[list[tuple[int, bytes]], Health]:
    """Return what the estimator on a python-can bus answers, and its health at the end."""
    answers = []
    with can.CanutilsLogReader(log) as reader, LeverBus("x", config=session.config) as bus:
        for message in reader:
            if message.channel == "lever":
                bus.send(message)
                answers += [(answer.arbitration_id, bytes(answer.data)) for answer in iter(bus.recv, None)]
        return answers, bus.estimator.health()


@pytest.mark.parametrize("at_once", [64, 65536])
def test_answers_are_those_of_the_bus(at_once: int, spoilt_log: Path, session: Session) -> None:
    expected, health = one_by_one(spoilt_log, session)
    feeder = Feeder(Estimator(session.config), at_once)
    traffic = EstimatorFrames(Recording([spoilt_log]), "lever")
    fed = np.concatenate([out.copy() for frames in traffic.chunks() for out, _ in feeder.feed(frames)])
    answers = fed[fed["flags"] == bulk.ANSWER]
    assert [(int(frame["id"]), frame["data"].tobytes()) for frame in answers] == expected
    assert feeder.estimator.health() == health
    assert health.corrupt > 20
    assert health.lost > 20
    assert health.late > 20
    inputs = fed[fed["flags"] == 0]
    assert len(inputs) + sum(traffic.others.values()) == traffic.frames
    assert min(traffic.others[kind] for kind in ("other_buses", "other_identifiers", "extended")) > 50
    assert traffic.other_samples == {"other"}


def test_rows_hold_what_belongs_to_a_sample(session: Session) -> None:
    """Against the trace of the simulation, which is made of its own record of what it sent and got."""
    feeder = Feeder(Estimator(session.config), 4096)
    pieces = [rows for frames in EstimatorFrames(Recording([session.log])).chunks() for _, rows in feeder.feed(frames)]
    rows = np.concatenate([*pieces, feeder.flush()])
    assert len(feeder.flush()) == 0
    trace = session.result.trace
    assert len(rows) == len(trace["time_s"])
    for slots in (bulk.SLOTS, bulk.RECORDED):
        data = np.ascontiguousarray(rows["data"][:, slots["STATE_ESTIMATE"]])
        np.testing.assert_array_equal(fields.columns("STATE_ESTIMATE", data)["nis"], trace["nis"])
        data = np.ascontiguousarray(rows["data"][:, slots["PILOT_PARAMETERS"]])
        found, wanted = fields.columns("PILOT_PARAMETERS", data)["k_p"], trace["k_p_estimate_N_m"]
        known = data.any(axis=1)  # from the first of them on
        np.testing.assert_array_equal(found[known], wanted[known])
        assert np.isfinite(wanted[known][-1000:]).all()
        assert np.isnan(wanted[~known]).all()
    data = np.ascontiguousarray(rows["data"][:, bulk.SLOTS["LEVER_SAMPLE"]])
    np.testing.assert_array_equal(codec.decode_columns("LEVER_SAMPLE", data)["theta"], trace["theta_measured_rad"])


def test_samples_are_those_that_were_sent(session: Session, spoilt_log: Path) -> None:
    samples = read_samples(EstimatorFrames(Recording([session.log])))
    trace = session.result.trace
    np.testing.assert_array_equal(samples["time_us"], np.rint(trace["time_s"] * 1e6))
    for name, column in (("theta", "_rad"), ("theta_dot", "_rad_s"), ("z_ddot", "_m_s2"), ("tau_m", "_N_m")):
        np.testing.assert_array_equal(samples[name], trace[f"{name}_measured{column}"])
    estimates = run_samples(session.config, samples)
    np.testing.assert_allclose(estimates["theta"][2000:], trace["theta_estimate_rad"][2000:], atol=1.01e-4)
    some = read_samples(EstimatorFrames(Recording([spoilt_log]), "lever"))
    assert 5500 < len(some["time_us"]) < 6000
    assert np.isnan(some["theta"]).sum() > 20


def test_which_bus_has_the_samples_must_be_clear(session: Session, tmp_path: Path) -> None:
    both = tmp_path / "both.log"
    text = session.log.read_text()
    both.write_text(text + text.replace(" lever ", " can1 "))
    with pytest.raises(LogError, match="choose with --channel: lever, can1"):
        list(EstimatorFrames(Recording([both])).chunks())
    traffic = EstimatorFrames(Recording([both]), "can1")
    assert sum(map(len, traffic.chunks())) == len(session.lines) == traffic.others["other_buses"]
    with pytest.raises(LogError, match=r"no sample .* on bus can7"):
        list(EstimatorFrames(Recording([both]), "can7").chunks())
