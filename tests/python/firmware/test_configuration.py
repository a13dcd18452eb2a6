"""What lever_config_check() and lever_init() accept: every setting at its limits and beyond, and every choice."""

from __future__ import annotations

import math
import zlib
from typing import Any

import numpy as np
import pytest
from lever_cdkf.firmware.config import CHOICES
from lever_cdkf.firmware.library import enum_names, ffi, lib
from lever_cdkf.firmware.native import Config, Setting, settings_table

ROWS = settings_table()


@pytest.fixture
def config() -> Any:
    """Return a lever_config_t with the defaults."""
    config = ffi.new("lever_config_t *")
    lib.lever_config_default(config)
    return config


def refused(config: Any) -> str | None:
    """Return what is wrong with it, by name; None if it is accepted. lever_init() is of the same opinion."""
    name = lib.lever_config_check(config)
    memory = ffi.new("lever_memory_t *")
    assert (lib.lever_init(memory, config) == ffi.NULL) == (name != ffi.NULL)
    return None if name == ffi.NULL else ffi.string(name).decode()


def test_the_table_has_a_row_for_every_float_in_the_order_of_the_struct(config: Any) -> None:
    assert lib.lever_setting_count() == ffi.sizeof("lever_settings_t") // 4
    assert [row.name for row in ROWS] == [name for name, _ in ffi.typeof("lever_settings_t").fields]
    for row in (lib.lever_setting_count(), 2**32 - 1):
        assert lib.lever_setting(row) == ffi.NULL


def test_the_defaults_are_those_of_the_table_and_are_accepted(config: Any) -> None:
    assert [getattr(config.settings, row.name) for row in ROWS] == [float(np.float32(row.default)) for row in ROWS]
    assert refused(config) is None


@pytest.mark.parametrize("row", ROWS, ids=lambda row: str(row.name))
@pytest.mark.requirement("R28")
def test_a_setting_is_accepted_at_both_limits_and_refused_by_name_beyond(row: Setting, config: Any) -> None:
    assert row.least <= row.default <= row.greatest
    assert row.unit
    assert len(row.meaning) > 10
    for value in (row.least, row.greatest):
        setattr(config.settings, row.name, value)
        assert refused(config) is None
    below, above = (
        float(np.nextafter(np.float32(limit), np.float32(end)))
        for limit, end in ((row.least, -math.inf), (row.greatest, math.inf))
    )
    for value in (below, above, math.nan, math.inf, -math.inf):
        setattr(config.settings, row.name, value)
        assert refused(config) == row.name


@pytest.mark.parametrize(
    ("sample_period", "gap_limit", "trim_corner", "accepted"),
    [
        (1e-3, 1.0, 3.0, False),
        (1e-3, 1.0, 1.51, False),
        (1e-3, 1.0, 1.5, True),
        (1e-3, 0.5, 3.0, True),
        (2e-2, 3.9e-2, 1.0, False),
        (2e-2, 4e-2, 1.0, True),
    ],
)
@pytest.mark.requirement("R28")
def test_settings_that_do_not_go_together_are_refused_by_name(
    sample_period: float, gap_limit: float, trim_corner: float, accepted: bool, config: Any
) -> None:
    """At trim_corner 3 and gap_limit 1 a few gaps drove all parameters to their bounds."""
    config.settings.sample_period, config.settings.gap_limit = sample_period, gap_limit
    config.settings.trim_corner = trim_corner
    assert refused(config) == (None if accepted else "gap_limit")


def test_no_accepted_dither_band_is_empty() -> None:
    limits = {row.name: row for row in ROWS}
    assert limits["dither_low"].greatest < limits["dither_high"].least


@pytest.mark.parametrize("choice", CHOICES)
def test_an_unknown_choice_is_refused_by_name(choice: str, config: Any) -> None:
    """Nor is LEVER_KEEP one, which is for commands."""
    for value in (len(enum_names(f"lever_{choice}")), lib.LEVER_KEEP):
        setattr(config, choice, value)
        assert refused(config) == choice


def test_there_is_no_parameter_beyond() -> None:
    count = len(enum_names("lever_model"))
    for of in (lib.lever_parameter_name, lib.lever_parameter_unit):
        assert of(0, 3) == of(count, 0) == ffi.NULL
        assert of(count - 1, 2) != ffi.NULL


@pytest.mark.requirement("R26")
def test_the_crc_of_the_settings_is_that_of_their_bytes_and_tells_every_one_of_them() -> None:
    def crc(values: list[float]) -> int:
        settings = ffi.new("lever_settings_t *", values)
        return int(lib.lever_settings_crc(settings))

    values = [row.default for row in ROWS]
    assert crc(values) == zlib.crc32(np.array(values, "<f4").tobytes()) == Config().settings_crc
    for k, value in enumerate(values):
        changed = float(np.nextafter(np.float32(value), np.float32(1e9)))
        assert crc([*values[:k], changed, *values[k + 1 :]]) != crc(values)


def test_a_refused_configuration_leaves_the_memory_alone(config: Any) -> None:
    memory = ffi.new("lever_memory_t *")
    ffi.memmove(memory, b"\x5a" * ffi.sizeof("lever_memory_t"), ffi.sizeof("lever_memory_t"))
    config.settings.theta_noise = math.nan
    for refusing in (config, ffi.NULL):
        assert lib.lever_init(memory, refusing) == ffi.NULL
    assert set(bytes(ffi.buffer(memory))) == {0x5A}
    assert lib.lever_init(ffi.NULL, config) == ffi.NULL
