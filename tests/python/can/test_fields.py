"""What users see of the estimator's messages, and what it says of itself and of commands."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from lever_cdkf.can import codec, fields
from lever_cdkf.can.commander import ACCEPTED, Commander, refusal, result_of
from lever_cdkf.can.identity import Identity
from lever_cdkf.errors import CodecError, LeverError
from lever_cdkf.firmware.config import Config
from lever_cdkf.firmware.estimator import Estimator
from lever_cdkf.firmware.library import enum_names
from python.conftest import Samples


def columns(name: str, **values: Any) -> dict[str, float]:
    """Return the columns of one frame."""
    frame = codec.encode(name, 0, values)
    found = fields.columns(name, np.frombuffer(frame, np.uint8).reshape(1, 8))
    return {key: float(column[0]) for key, column in found.items()}


@pytest.mark.parametrize("valid", [0, 1])
def test_an_estimate_that_may_not_be_used_is_no_number(valid: int) -> None:
    state = columns("STATE_ESTIMATE", valid=valid, theta=0.25, theta_dot=0.5, innovation=1.5, time_low=7)
    wanted = [0.25, 0.5, 1.5, 2.25] if valid else [math.nan] * 4
    assert [state[key] for key in ("theta", "theta_dot", "innovation", "nis")] == pytest.approx(wanted, nan_ok=True)
    assert (state["time_low"], state["valid"]) == (7, valid)
    motor = columns("MOTOR_COMMAND", model="lever", valid=valid, torque=0.5, dither=0.5, time_low=0)
    assert motor["torque"] == 0.5  # of a gate that closes, too


def test_flags_of_health_are_the_bits_of_the_facade() -> None:
    flags = enum_names("lever_fault")
    none = dict.fromkeys((f"fault_{name}" for name in flags.values()), 0)
    rest = {"mode": "run", "restarts": 0, "excitation": 0.1}
    for bit, name in flags.items():
        assert columns("HEALTH", **rest, **none | {f"fault_{name}": 1})["faults"] == bit
    assert columns("HEALTH", **rest, **dict.fromkeys(none, 1))["faults"] == sum(flags)


def test_frames_belong_to_the_sample_whose_low_bits_they_carry() -> None:
    fields_sent = {"time_low": np.array([0.0, 5.0, 65535.0, 1.0])}
    assert fields.belongs(fields_sent, np.array([1 << 16, 5, (1 << 32) - 1, 2])).tolist() == [True, True, True, False]


def answers(estimator: Estimator, name: str) -> list[dict[str, float]]:
    """Return what an estimator has to say, of one message."""
    frames = iter(estimator.next_frame, None)
    return [codec.decode(*frame)[1] for frame in frames if frame[0] == codec.message(name).frame_id]


@pytest.mark.requirement("R24")
def test_every_command_is_acknowledged_and_a_repeated_one_refused(samples: Samples) -> None:
    estimator, commander, sent = Estimator(), Commander(), list[bytes]()
    for lever, base in samples(0, 20):
        estimator.on_frame(*lever)
        estimator.on_frame(*base)
        estimator.step()
        answers(estimator, "COMMAND_ACK")
    for k in range(20):
        counter = commander.send({"request": "freeze"}, lambda _, data: sent.append(data))
        assert counter == k % 16
        estimator.on_frame(0x120, sent[-1])
        (ack,) = answers(estimator, "COMMAND_ACK")
        assert (ack["command_counter"], result_of(ack)) == (counter, ACCEPTED)
    estimator.on_frame(0x120, sent[-1])
    (ack,) = answers(estimator, "COMMAND_ACK")
    assert refusal(result_of(ack)) == (
        "the estimator refuses COMMAND: its counter is out of sequence: is there another sender of COMMAND?"
    )
    with pytest.raises(CodecError, match=r"COMMAND.request cannot be 'stop'"):
        commander.send({"request": "stop"}, lambda _, data: None)
    assert commander.send({}, lambda _, data: None) == 20 % 16


@pytest.mark.requirement("R26")
def test_an_estimator_says_what_it_is(samples: Samples) -> None:
    config = Config(preload="fixed", estimator="joint", settings={"m_p": 3.0})
    estimator, identity = Estimator(config), Identity()
    assert (identity.version, identity.contract, identity.settings_crc, identity.choices) == (None, None, None, {})
    for lever, base in samples(0, 5):
        estimator.on_frame(*lever)
        estimator.on_frame(*base)
        estimator.step()
        for page in answers(estimator, "IDENTITY"):
            identity.take(page)
    assert identity.version == "0.2.0"
    assert identity.settings_crc == config.settings_crc != Config().settings_crc
    assert identity.choices == config.choices
    assert identity.dither_rms == 0.0
    identity.check("it")
    identity.take({"contract": 3.0})
    with pytest.raises(LeverError, match=r"it speaks contract 3 of lever.dbc, this program 2"):
        identity.check("it")
