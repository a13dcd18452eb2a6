"""No execution of what the harnesses run has undefined behaviour; and what is put there is found."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from proof import eva

SEEDED = {
    "e2e": ("can/e2e.c", "(size_t)FRAME_BYTES - 1u", "(size_t)FRAME_BYTES"),
    "codec": ("can/layout.c", "i < layout->codes", "i <= layout->codes"),
    "kernels": ("math/trigonometry.c", "(fabsf(angle) <= 30.0f) ? angle : 0.0f", "angle"),
    "link": ("app/link.c", "for (; link->parts < (uint8_t)PARTS; link", "for (; link->parts <= (uint8_t)PARTS; link"),
    "settings_text": ("port/linux/settings.c", "(sizeof line->text - 1u)", "(sizeof line->text + 8u)"),
    "settings_value": ("port/linux/settings.c", "const char *fraction = end + 1;", "const char *fraction = end + 2;"),
    "slcan": ("port/slcan/slcan.c", "((uint32_t)SLCAN_LINE_BYTES - 1u)", "((uint32_t)SLCAN_LINE_BYTES + 8u)"),
    "torque_gate": ("app/torque_gate.c", "lesser(share, 1.0f)", "(float)(int32_t)(share * 1.0e9f)"),
}
"""An overflow in a file of each harness: what is replaced by what."""


@pytest.mark.requires(eva.PROGRAM)
@pytest.mark.parametrize("name", eva.SOURCES)
@pytest.mark.requirement("R14", "S6")
def test_there_is_no_alarm(name: str, record_property: Callable[[str, object], None]) -> None:
    proof = eva.prove(name)
    record_property("alarms", proof.alarms)
    record_property("statements reached [%]", proof.reached)
    assert proof.alarms == 0, proof.text
    assert proof.reached >= 97


@pytest.mark.requires(eva.PROGRAM)
@pytest.mark.parametrize("name", SEEDED)
def test_a_seeded_overflow_is_found(name: str, tmp_path: Path) -> None:
    path, right, wrong = SEEDED[name]
    source = (eva.FIRMWARE / path).read_text(encoding="utf-8")
    assert right in source
    mutant = tmp_path / Path(path).name
    mutant.write_text(source.replace(right, wrong), encoding="utf-8")
    others = [eva.FIRMWARE / each for each in eva.SOURCES[name] if each != path]
    assert eva.prove(name, [mutant, *others]).alarms > 0
