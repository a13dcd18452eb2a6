"""What is estimated, as all that shows it names it; structs of the firmware as numpy has them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from lever_cdkf.errors import LeverError, SettingsError
from lever_cdkf.firmware.aircraft import AircraftResponse, SeatTransfer
from lever_cdkf.firmware.config import model_parameters, setting, settings_table, shortest, single
from lever_cdkf.firmware.library import enum_names, enum_words, ffi, struct_dtype
from lever_cdkf.firmware.quantities import DYNAMICS, parameters, quantities, recorded_name

EXPECTED = {
    "m_p": ("kg", "mass", "m<sub>p</sub>", "m_p_estimate_kg", "m_p_sigma_kg"),
    "c_p": ("N s/m", "damping", "c<sub>p</sub>", "c_p_estimate_N_s_m", "c_p_sigma_N_s_m"),
    "k_p": ("N/m", "stiffness", "k<sub>p</sub>", "k_p_estimate_N_m", "k_p_sigma_N_m"),
    "m": ("kg", "mass", "m", "m_estimate_kg", "m_sigma_kg"),
    "c": ("N s/m", "damping", "c", "c_estimate_N_s_m", "c_sigma_N_s_m"),
    "k": ("N/m", "stiffness", "k", "k_estimate_N_m", "k_sigma_N_m"),
    "a21": ("1/s²", "minus stiffness", "a<sub>21</sub>", "a21_estimate_1_s2", "a21_sigma_1_s2"),
    "a22": ("1/s", "minus damping", "a<sub>22</sub>", "a22_estimate_1_s", "a22_sigma_1_s"),
    "b21": ("1", "answer to the floor", "b<sub>21</sub>", "b21_estimate", "b21_sigma"),
    "k_hand": ("1/s²", "stiffness per mass", "k<sub>hand</sub>", "k_hand_estimate_1_s2", "k_hand_sigma_1_s2"),
    "c_hand": ("1/s", "damping per mass", "c<sub>hand</sub>", "c_hand_estimate_1_s", "c_hand_sigma_1_s"),
    "c_space": ("1/s", "of it, in space", "c<sub>space</sub>", "c_space_estimate_1_s", "c_space_sigma_1_s"),
    "natural_frequency": (
        "Hz", "natural frequency", "f<sub>n</sub>", "natural_frequency_estimate_Hz", "natural_frequency_sigma_Hz",
    ),
    "damping_ratio": ("1", "damping ratio", "ζ", "damping_ratio_estimate", "damping_ratio_sigma"),
}  # fmt: skip


def test_each_quantity_has_its_names() -> None:
    every = {each.key: each for model in enum_names("lever_model").values() for each in quantities(model)}
    assert every.keys() == EXPECTED.keys()
    for key, each in every.items():
        shown = (each.shown_unit, each.name, each.symbol, each.column("estimate"), each.column("sigma"))
        assert shown == EXPECTED[key]
        assert each.signed is (key in ("a21", "a22", "b21"))
        assert each.least == (-math.inf if each.signed else 0.0)
    assert quantities("lever") == (*parameters("lever"), *DYNAMICS)


@pytest.mark.parametrize(
    ("column", "recorded"),
    [
        ("k_p_estimate_N_m", "k_p_recorded_N_m"), ("k_p_sigma_N_m", "k_p_recorded_sigma_N_m"), ("nis", "nis_recorded"),
        ("theta_estimate_rad", "theta_recorded_rad"), ("mode", "mode_recorded"),
    ],
)  # fmt: skip
def test_names_of_recorded_estimates(column: str, recorded: str) -> None:
    assert recorded_name(column) == recorded


def test_a_model_or_setting_that_there_is_not() -> None:
    with pytest.raises(SettingsError, match=r"^model = 'arm' is not known; allowed: lever, linear_physical, "):
        model_parameters("arm")
    with pytest.raises(SettingsError, match=r"^unknown setting 'm_q'; did you mean m_p\?$"):
        setting("m_q")
    with pytest.raises(SettingsError, match=r"^unknown setting 'zzzz'; `lever settings` lists them all$"):
        setting("zzzz")
    with pytest.raises(SettingsError, match=r"^3 is no name of a setting"):
        setting(3)  # type: ignore[arg-type]
    row = settings_table()[0]
    for wrong in ("1", True, None, math.nan, 2.0 * row.greatest + 1.0):
        with pytest.raises(SettingsError, match=rf"^{row.name} = .* is out of range: it must be a number from "):
            row.check(wrong)  # type: ignore[arg-type]


@pytest.mark.parametrize("value", [0.1, 1.0, 123456.7, 1e-30, 3.4e38, 0.333333333, 16777217.0, -2.5e-7])
def test_numbers_are_shown_as_short_as_single_precision_lets_them(value: float) -> None:
    short = shortest(single(value))
    assert np.float32(short) == np.float32(value)
    assert len(repr(short)) <= len(repr(float(np.float32(value))))
    assert float(str(np.float32(value))) == short  # numpy's shortest


def test_structs_are_laid_out_as_in_c() -> None:
    for name in ("lever_sample_t", "lever_estimate_t", "lever_health_t", "lever_frame_t"):
        dtype = struct_dtype(name)
        assert dtype.itemsize == ffi.sizeof(name)
        for field, described in ffi.typeof(name).fields:
            assert dtype.fields is not None
            assert dtype.fields[field][1] == described.offset
            assert dtype.fields[field][0].itemsize == ffi.sizeof(described.type)
    sample = np.zeros(1, struct_dtype("lever_sample_t"))
    sample["theta"], sample["theta_valid"], sample["time_us"] = 0.25, True, 2**32 - 1
    (read,) = ffi.from_buffer("lever_sample_t[]", sample)
    assert (read.theta, read.theta_valid, read.time_us, read.z_ddot_valid) == (0.25, True, 2**32 - 1, False)


@pytest.mark.parametrize("enum", ["lever_mode", "lever_fault", "lever_platform_fault", "lever_bounce", "lever_request"])
def test_names_of_enums_have_no_prefix(enum: str) -> None:
    names = enum_names(enum)
    assert list(names) == sorted(names)
    assert not any("lever" in name or name == "count" or name != name.lower() for name in names.values())
    assert set(enum_words(enum)) <= set(names.values())
    assert all(words == " ".join(words.split()) for words in enum_words(enum).values())


def test_limits_of_the_margin_where_nothing_else_is_said() -> None:
    flown = AircraftResponse([1.0, 2.0, 3.0], [1.0 + 0j, 1j, 0.5 + 0j], gain_sigma=0.1, phase_sigma=0.1)
    assert (flown.warning, flown.alarm, flown.name) == (5.0, 4.0, "an aircraft")
    assert flown.seat_modes() == []
    for count in (2, 25):
        with pytest.raises(
            LeverError, match=r"^the response of an aircraft has 3 to 24 frequencies, and a value at each$"
        ):
            AircraftResponse(range(count), [1j] * count, gain_sigma=0.1, phase_sigma=0.1)
    seat = SeatTransfer(1.0, [(0.0, 0.0, 1.0, 1.0)] * 4)
    with pytest.raises(LeverError, match="between accelerometer and seat there are 1 to 3 modes"):
        AircraftResponse([1.0, 2.0, 3.0], [1j] * 3, gain_sigma=0.1, phase_sigma=0.1, seat=seat)
