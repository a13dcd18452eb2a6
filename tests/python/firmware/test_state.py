"""The saved state has every member of an instance but what follows from its configuration: by the compiler's own
account of the struct."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from elftools.elf.elffile import ELFFile

FIRMWARE = Path(__file__).parents[3] / "firmware"
LEFT_OUT = re.compile(
    r"""estimator\.setup\.(settings|model_in_use|base_scale|torque_scale|delay_rest|delay_samples|constants\..*)
    | estimator\.seat\.aircraft                  # set again by lever_aircraft()
    | estimator\.cdkf\.scaling\..*
    | dither\.(low|high|scale|rms_most|fade)
    | gate\.(limit|slew|open_step|square_most|sustained|amplitude_slope|period_us|silence_us)
    | link\.\w+_receiver\.(tolerance\..*|data_id_base)
    | link\.(has_sample|sample\..*)             # there is none between two samples
    | link\.(period_us|publish_us)
    | settings_sum
    | bounce\.aircraft""",
    re.VERBOSE,
)
"""Members that lever_init() makes of the configuration, or lever_state_restore() of the choices."""
PROGRAM = """\
#include "app/instance.h"
#include "app/state.h"
#include <stdio.h>

struct lever instance;

int main(void)
{
    for (uint32_t i = 0u; i < state_row_count(); i++) {
        const state_row_t *row = state_row(i);
        (void)printf("%u %u\\n", (unsigned)row->offset, (unsigned)(row->count * row->size));
    }
    return 0;
}
"""


def leaves(die: Any, name: str, offset: int) -> Iterator[tuple[str, range]]:
    """Yield the members of a type that have none themselves, with the bytes that each has."""
    kind = die.tag.removeprefix("DW_TAG_")
    if kind in ("typedef", "const_type"):
        yield from leaves(die.get_DIE_from_attribute("DW_AT_type"), name, offset)
    elif kind == "structure_type":
        for member in die.iter_children():
            at = offset + member.attributes["DW_AT_data_member_location"].value
            inner = f"{name}.{member.attributes['DW_AT_name'].value.decode()}".lstrip(".")
            yield from leaves(member.get_DIE_from_attribute("DW_AT_type"), inner, at)
    elif kind == "array_type":
        element = die.get_DIE_from_attribute("DW_AT_type")
        counts = [child.attributes["DW_AT_upper_bound"].value + 1 for child in die.iter_children()]
        size = size_of(element)
        total = 1
        for count in counts:
            total *= count
        for index in range(total):
            yield from leaves(element, f"{name}[{index}]", offset + index * size)
    else:
        yield name, range(offset, offset + size_of(die))


def size_of(die: Any) -> int:
    while "DW_AT_byte_size" not in die.attributes:
        die = die.get_DIE_from_attribute("DW_AT_type")
    return int(die.attributes["DW_AT_byte_size"].value)


@pytest.mark.requirement("R53")
def test_every_member_is_saved_or_follows_from_the_configuration(build_dir: Path, tmp_path: Path) -> None:
    (tmp_path / "rows.c").write_text(PROGRAM)
    program = tmp_path / "rows"
    flags = ["-std=c99", "-g", "-O0", f"-I{FIRMWARE}", f"-I{build_dir}/firmware/build_headers"]
    sources = [tmp_path / "rows.c", FIRMWARE / "app/state.c", build_dir / "firmware/liblever_cdkf.a"]
    subprocess.run([*shlex.split(os.environ.get("CC", "cc")), *flags, *sources, "-o", program, "-lm"], check=True)
    output = subprocess.run([program], check=True, capture_output=True, text=True).stdout
    rows = [tuple(map(int, line.split())) for line in output.splitlines()]
    saved = [byte for offset, length in rows for byte in range(offset, offset + length)]
    assert len(set(saved)) == len(saved)  # nothing twice
    with program.open("rb") as file:
        dwarf = ELFFile(file).get_dwarf_info()
        struct = next(
            die
            for unit in dwarf.iter_CUs()
            for die in unit.iter_DIEs()
            if die.tag == "DW_TAG_structure_type"
            and "DW_AT_name" in die.attributes
            and die.attributes["DW_AT_name"].value == b"lever"
            and "DW_AT_declaration" not in die.attributes
        )
        members = dict(leaves(struct, "", 0))
    assert len(members) > 500
    whole = {name for name, of in members.items() if set(of) <= set(saved)}
    partly = {name for name, of in members.items() if set(of) & set(saved)} - whole
    assert not partly
    left_out = {name for name in members if LEFT_OUT.fullmatch(name)}
    assert sorted(members.keys() - whole - left_out) == []
    assert sorted(whole & left_out) == []
