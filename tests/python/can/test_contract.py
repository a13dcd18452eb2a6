"""The constants of the C are those of lever.dbc, and the DBC keeps the rules that all its messages share."""

from __future__ import annotations

import pytest
from lever_cdkf.firmware.config import CHOICES
from lever_cdkf.firmware.library import enum_words
from python.can.codec import DBC, MULTIPLEXED, Codec, data_id_base, is_quantity, limits, not_available, scaled


def test_identifiers(codec: Codec) -> None:
    expected = {f"MESSAGE_{message.name}_ID": message.frame_id for message in DBC.messages}
    assert codec.enum("message_id") == expected


def test_data_ids(codec: Codec) -> None:
    expected = {f"MESSAGE_{message.name}_DATA_ID": data_id_base(message) for message in DBC.messages}
    assert codec.enum("message_data_id") == expected


def test_the_version_is_what_identity_says(codec: Codec) -> None:
    assert DBC.version == str(codec.lib.MESSAGE_CONTRACT)


def test_no_two_messages_have_the_same_data_id_with_the_same_counter() -> None:
    """Of a frame taken for another message the CRC is wrong then, whatever its counter is."""
    bases = [data_id_base(message) for message in DBC.messages]
    assert len(set(bases)) == len(bases) == 20
    assert max(bases) + 15 <= 255


def test_every_message_has_eight_bytes_and_the_e2e_header() -> None:
    for message in DBC.messages:
        assert message.length == 8
        assert not message.is_extended_frame
        header = [(signal.name, signal.start, signal.length) for signal in message.signals[:2]]
        assert header == [("crc", 0, 8), ("counter", 8, 4)]
        assert all(signal.byte_order == "little_endian" for signal in message.signals)


def test_structs_have_the_signals(codec: Codec) -> None:
    for message in DBC.messages:
        signals = {signal.name for signal in message.signals} - {"crc", "counter"}
        if message.name in MULTIPLEXED:
            signals = signals & {"model", "valid"} | {MULTIPLEXED[message.name]}
        if message.name == "HEALTH":
            signals = {name for name in signals if not name.startswith("fault_")} | {"faults"}
        assert set(codec.members(message.name)) == signals


def test_every_model_has_its_parameters(codec: Codec) -> None:
    models = codec.enum("lever_model")["LEVER_MODEL_COUNT"]
    for name in MULTIPLEXED:
        of_models = [
            signal.multiplexer_ids for signal in DBC.get_message_by_name(name).signals if signal.multiplexer_ids
        ]
        assert sorted(of_models) == [[model] for model in range(models) for _ in range(3)]


def test_ranges_use_all_bits_but_not_available() -> None:
    """So that the limits of the C, those of the bits, are those of the DBC; COMMAND says keep instead."""
    for message in DBC.messages:
        for signal in message.signals:
            least, greatest = limits(signal)
            if is_quantity(signal) and message.name != "COMMAND":
                assert not_available(signal) == (least if signal.is_signed else greatest)
                assert signal.choices is not None
                assert str(signal.choices[not_available(signal)]) == "not_available"
                least, greatest = (least + 1, greatest) if signal.is_signed else (least, greatest - 1)
            expected = [scaled(signal, raw) for raw in (least, greatest)]
            assert (signal.minimum, signal.maximum) == pytest.approx(expected), signal.name


def test_scales_have_whole_reciprocals() -> None:
    """So that the counts per unit of the C are exact in a float."""
    for message in DBC.messages:
        for signal in message.signals:
            assert signal.offset == 0
            assert float(signal.scale) == 1 / round(1 / signal.scale), signal.name


def test_named_values_are_the_enums(codec: Codec) -> None:
    choices = (*CHOICES, "request", "mode", "bounce")
    enums = {name: codec.enum(f"lever_{name}") for name in choices}
    enums |= {name: codec.enum(f"message_{name}") for name in ("page", "part", "result", "cause")}
    tested = 0
    for message in DBC.messages:
        for signal in message.signals:
            if signal.name in ("evidence", "verdict"):
                continue  # are those of the .def files: tests/quality/test_verdicts.py
            if signal.name not in enums:
                assert all(str(name) == "not_available" for name in (signal.choices or {}).values())
                continue
            prefix = "LEVER" if signal.name in choices else "MESSAGE"
            prefix = f"{prefix}_{signal.name.upper()}_"
            expected = {value: name.removeprefix(prefix).lower() for name, value in enums[signal.name].items()}
            expected = {value: name for value, name in expected.items() if name != "count"}
            if message.name == "COMMAND" and signal.name != "request":
                expected[codec.enum("lever_keep")["LEVER_KEEP"]] = "keep"
            assert signal.choices is not None
            assert {value: str(name) for value, name in signal.choices.items()} == expected, signal.name
            tested += 1
    assert tested == 29


def test_every_fault_has_its_named_bit(codec: Codec) -> None:
    health = DBC.get_message_by_name("HEALTH")
    bits = {signal.name: 1 << signal.start - 16 for signal in health.signals if signal.name.startswith("fault_")}
    expected = {name.removeprefix("LEVER_").lower(): bit for name, bit in codec.enum("lever_fault").items()}
    assert bits == expected


@pytest.mark.requirement("R57")
def test_every_fault_is_described_as_in_the_header() -> None:
    health = DBC.get_message_by_name("HEALTH")
    for name, words in enum_words("lever_fault").items():
        comment = health.get_signal_by_name(f"fault_{name}").comment
        assert comment in (f"{words}.", f"{words[0].upper()}{words[1:]}."), name
