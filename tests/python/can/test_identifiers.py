"""Identifiers that are shifted as a whole: buses, logs, the DBC, and two levers side by side."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import can
import cantools.database
import numpy as np
import pytest
from lever_cdkf.can import buses, codec, identifiers, logs
from lever_cdkf.cli.main import Parser, main
from lever_cdkf.errors import LeverError

SHIFTS = (["--id-offset", "0x40"], ["--id-base", "0x18FF0000"])


def choose(arguments: Sequence[str]) -> None:
    parser = Parser()
    identifiers.add_identifier_options(parser)
    identifiers.use(parser.parse_args(arguments))


@pytest.fixture(autouse=True)
def as_they_are() -> Iterator[None]:
    yield
    choose([])


def test_without_an_option_they_are_those_of_the_dbc() -> None:
    choose([])
    assert identifiers.chosen().are_those_of_the_dbc
    assert identifiers.to_bus(0x110) == (0x110, False)
    assert identifiers.from_bus(0x110, False) == (0x110, False)
    assert identifiers.from_bus(0x110, True) == (0x110, True)


@pytest.mark.requirement("R20")
@pytest.mark.parametrize("arguments", SHIFTS)
def test_every_identifier_is_shifted_and_comes_back_and_no_other_is_taken_for_one(arguments: list[str]) -> None:
    choose(arguments)
    ours = {message.frame_id for message in codec.database().messages}
    assert {identifiers.from_bus(*identifiers.to_bus(identifier))[0] for identifier in ours} == ours
    shifted = {identifiers.to_bus(identifier) for identifier in ours}
    for extended in (False, True):
        for identifier in (*range(0x800), *range(0x18FF0000, 0x18FF0800)):
            back, still_extended = identifiers.from_bus(identifier, extended)
            assert (back in ours and not still_extended) == ((identifier, extended) in shifted)


@pytest.mark.requirement("R20")
@pytest.mark.parametrize("arguments", SHIFTS)
def test_a_log_and_a_bus_are_read_as_if_they_had_those_of_the_dbc(arguments: list[str], tmp_path: Path) -> None:
    data = codec.encoder("BASE_SAMPLE")(3, 1.0, 1000)
    choose(arguments)
    identifier, extended = identifiers.to_bus(0x111)
    log = tmp_path / "two.log"
    digits = f"{identifier:08X}" if extended else f"{identifier:03X}"
    log.write_text(f"(1.000000) can0 111#{data.hex()}\n(1.000100) can0 {digits}#{data.hex()}\n")
    frames = np.concatenate(list(logs.Recording([log]).chunks()))
    assert frames["id"][1] == 0x111
    assert frames["flags"][1] == 0
    ids = {message.frame_id for message in codec.database().messages}
    assert frames["flags"][0] != 0 or frames["id"][0] not in ids  # of the other lever
    as_they_came = np.concatenate(list(logs.Recording([log], translated=False).chunks()))
    assert list(as_they_came["id"]) == [0x111, identifier]
    with buses.open_bus("virtual", "shifted", {}) as ours, can.Bus(interface="virtual", channel="shifted") as theirs:
        ours.send(can.Message(arbitration_id=0x111, is_extended_id=False, data=data))
        sent = theirs.recv(1.0)
        assert sent is not None
        assert (sent.arbitration_id, sent.is_extended_id) == (identifier, extended)
        assert bytes(sent.data) == data
        theirs.send(sent)
        theirs.send(can.Message(arbitration_id=0x111, is_extended_id=False, data=data))
        received, foreign = ours.recv(1.0), ours.recv(1.0)
        assert received is not None
        assert (received.arbitration_id, received.is_extended_id) == (0x111, False)
        assert foreign is not None
        assert foreign.is_extended_id or foreign.arbitration_id not in ids


@pytest.mark.parametrize("arguments", [["--offset", "0x40"], ["--id-base", "0x18FF0000"]])
def test_the_shifted_database_differs_in_identifiers_alone(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["dbc", "--text", *arguments]) == 0
    shifted = cantools.database.load_string(capsys.readouterr().out, "dbc")
    assert isinstance(shifted, cantools.database.can.Database)
    for ours, theirs in zip(codec.database().messages, shifted.messages, strict=True):
        assert (theirs.frame_id, theirs.is_extended_frame) == identifiers.to_bus(ours.frame_id)
        assert theirs.signals == ours.signals or [str(each) for each in theirs.signals] == [
            str(each) for each in ours.signals
        ]
        assert theirs.comment == ours.comment
        assert theirs.dbc is not None
        assert ours.dbc is not None
        assert {name: each.value for name, each in theirs.dbc.attributes.items()} == {
            name: each.value for name, each in ours.dbc.attributes.items()
        }


@pytest.mark.parametrize("text", ["x", "-1", "0x5E1", "2000"])
def test_an_offset_for_which_there_is_no_room(text: str) -> None:
    with pytest.raises(LeverError, match="must be a number from 0 to 0x5e0"):
        choose([f"--id-offset={text}"])
