"""Each private constant of the core says what it is, has a name of its own, and names only rows that there are."""

from __future__ import annotations

from collections import Counter

from lever_cdkf.firmware.sample_clock import CLOCK_WRONG
from lever_sil.envelope.conditions import CONDITIONS
from lever_sil.envelope.rules import RULES
from lever_sil.faults.rows import ROWS
from quality import constants, definitions

_ROWS = {*CONDITIONS, *RULES, *ROWS}


def test_each_constant_says_what_it_is_or_has_a_comment_above_it() -> None:
    silent = [f"{each.file}: {each.name}" for each in constants.constants() if not each.meaning and not _is_below(each)]
    assert not silent


def test_each_name_has_one_meaning() -> None:
    names = Counter(each.name for each in constants.constants())
    assert not [name for name, count in names.items() if count > 1]


def test_the_rows_in_brackets_exist() -> None:
    unknown = [f"{each.name}: {row}" for each in constants.constants() for row in each.rows if row not in _ROWS]
    assert not unknown


def test_the_table_is_not_empty_and_knows_units_from_rows() -> None:
    found = {each.name: each for each in constants.constants()}
    assert len(found) > 150
    assert found["AWAKE"].rows == ["rest_120s", "freed"]
    assert found["KINEMATICS_CORNER"].rows == []


def test_host_and_firmware_take_the_same_clock_for_wrong() -> None:
    """As both say: the evidence shows as CALIBRATION, and the commands name another sample_period."""
    thresholds = {name: threshold for name, threshold, *_ in definitions.rows("evidence")}
    assert float(thresholds["clock"]) == CLOCK_WRONG


def _is_below(constant: constants.Constant) -> bool:
    """Whether the line above its definition ends a comment."""
    lines = (constants.FIRMWARE / constant.file).read_text(encoding="utf-8").splitlines()
    place = next(i for i, line in enumerate(lines) if line.startswith(f"#define {constant.name} "))
    return lines[place - 1].rstrip().endswith("*/")
