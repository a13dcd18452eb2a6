"""What files with names and units say of each column of a trace, against lever.dbc as cantools reads it."""

from __future__ import annotations

from datetime import datetime, timezone
from pathlib import Path
from typing import Any

import cantools
import numpy as np
import pytest
from lever_cdkf.exports.columns import (
    ESTIMATE,
    MEASUREMENT,
    RECORDED,
    TRUTH,
    Column,
    as_words,
    columns,
    together,
    words,
)
from lever_cdkf.exports.signal_files import calendar
from lever_cdkf.firmware.library import enum_names
from lever_cdkf.firmware.quantities import quantities

MEASURED = {
    "theta_measured_rad": ("theta_measured", "LEVER_SAMPLE", "theta"),
    "theta_dot_measured_rad_s": ("theta_dot_measured", "LEVER_SAMPLE", "theta_dot"),
    "z_ddot_measured_m_s2": ("z_ddot_measured", "BASE_SAMPLE", "z_ddot"),
    "tau_m_measured_N_m": ("tau_m_measured", "LEVER_SAMPLE", "tau_m"),
    "grip_force_measured_N": ("grip_force_measured", "GRIP_SAMPLE", "grip_force"),
}
AT_SAMPLES = {
    "theta_estimate_rad": ("theta_estimate", "STATE_ESTIMATE", "theta"),
    "theta_dot_estimate_rad_s": ("theta_dot_estimate", "STATE_ESTIMATE", "theta_dot"),
    "nis": ("nis_estimate", "STATE_ESTIMATE", "nis"),
    "correction_rad": ("correction", "CORRECTION", "correction"),
    "dither_N_m": ("dither", "MOTOR_COMMAND", "dither"),
}
HELD = {
    "mode": ("mode", "HEALTH", "mode"), "faults": ("faults", "HEALTH", "faults"),
    "lost": ("lost", "LINK_HEALTH", "lost"), "corrupt": ("corrupt", "LINK_HEALTH", "corrupt"),
    "late": ("late", "LINK_HEALTH", "late"), "restarts": ("restarts", "HEALTH", "restarts"),
    "excitation_rad_s": ("excitation", "HEALTH", "excitation"),
    "feedthrough_frequency_Hz": ("feedthrough_frequency", "FEEDTHROUGH", "frequency"),
    "feedthrough_real_rad_s2_m": ("feedthrough_real", "FEEDTHROUGH", "real"),
    "feedthrough_imaginary_rad_s2_m": ("feedthrough_imaginary", "FEEDTHROUGH", "imaginary"),
    "feedthrough_gain_sigma": ("feedthrough_gain_sigma", "FEEDTHROUGH", "gain_sigma"),
    "feedthrough_phase_sigma_rad": ("feedthrough_phase_sigma", "FEEDTHROUGH", "phase_sigma"),
    "bounce": ("bounce", "STABILITY", "bounce"), "gain_margin_dB": ("gain_margin", "STABILITY", "gain_margin"),
    "gain_margin_sigma_dB": ("gain_margin_sigma", "STABILITY", "gain_margin_sigma"),
    "modulus": ("modulus", "STABILITY", "modulus"), "modulus_sigma": ("modulus_sigma", "STABILITY", "modulus_sigma"),
    "bounce_frequency_Hz": ("bounce_frequency", "STABILITY", "frequency"),
    "evidence": ("evidence", "TEST_RATIO", "evidence"), "test_ratio": ("test_ratio", "TEST_RATIO", "ratio"),
    "verdict": ("verdict", "TEST_RATIO", "verdict"),
}  # fmt: skip
TRUE = {
    "theta_true_rad": ("theta", "rad"), "theta_dot_true_rad_s": ("theta_dot", "rad/s"),
    "z_ddot_true_m_s2": ("z_ddot", "m/s^2"), "tau_m_true_N_m": ("tau_m", "N m"), "trim_true_rad": ("trim", "rad"),
    "gain_margin_true_dB": ("gain_margin", "dB"),
}  # fmt: skip


@pytest.fixture(scope="module")
def dbc(root: Path) -> Any:
    return cantools.database.load_file(root / "firmware/can/lever.dbc")


def one(source: str, model: str = "lever") -> Column:
    (found,) = columns(["time_s", source], model)
    assert found.source == source
    return found


def check(column: Column, name: str, message: str, field: str, dbc: Any) -> None:
    assert (column.name, column.message, column.field) == (name, message, field)
    if field in ("nis", "faults"):
        assert column.unit == ("1" if field == "nis" else "")
        assert column.comment.endswith(".")
    else:
        signal = dbc.get_message_by_name(message).get_signal_by_name(field)
        assert (column.unit, column.comment) == (signal.unit or "", signal.comment or "")


@pytest.mark.parametrize("source", [*MEASURED, *AT_SAMPLES, *HELD])
def test_columns_of_messages(source: str, dbc: Any) -> None:
    column = one(source)
    check(column, *{**MEASURED, **AT_SAMPLES, **HELD}[source], dbc)
    assert column.held is (source in HELD)
    assert column.kind == (MEASUREMENT if source in MEASURED else ESTIMATE)


@pytest.mark.parametrize("model", enum_names("lever_model").values())
def test_columns_of_quantities(model: str, dbc: Any) -> None:
    for each in quantities(model):
        is_dynamics = each.key in ("natural_frequency", "damping_ratio")
        for kind, message in (("estimate", "PILOT_PARAMETERS"), ("sigma", "PILOT_SIGMA")):
            column = one(each.column(kind), model)
            field = each.key if kind == "estimate" else f"{each.key}_sigma"
            name = f"{each.key}_{kind}"
            check(column, name, "PILOT_DYNAMICS" if is_dynamics else message, field, dbc)
            assert (column.held, column.kind) == (True, ESTIMATE)
            recorded = one(
                each.column(kind).replace("_estimate", "_recorded").replace("_sigma", "_recorded_sigma"), model
            )
            assert (recorded.kind, recorded.held, recorded.unit) == (RECORDED, True, column.unit)
            assert recorded.message == column.message
        true = one(each.column("true"), model)
        assert (true.name, true.field, true.unit, true.message) == (f"{each.key}_true", each.key, each.unit, "")
        assert (true.kind, true.held) == (TRUTH, False)
        assert true.comment == one(each.column("estimate"), model).comment


@pytest.mark.parametrize("source", TRUE)
def test_columns_of_the_truth(source: str) -> None:
    column, (field, unit) = one(source), TRUE[source]
    assert (column.name, column.field, column.unit, column.kind) == (f"{field}_true", field, unit, TRUTH)
    assert column.message == ""
    assert column.comment.endswith(".")


def test_columns_that_nobody_knows_and_their_order() -> None:
    found = columns(["time_s", "mine", "mode", "theta_true_rad"], "lever")
    assert [column.source for column in found] == ["mine", "mode", "theta_true_rad"]
    assert found[0] == Column("mine", "mine", "mine", "", "", "", MEASUREMENT)
    grouped = together(found, lambda column: column.kind)
    assert {kind: [column.source for column in each] for kind, each in grouped.items()} == {
        MEASUREMENT: ["mine"], ESTIMATE: ["mode"], TRUTH: ["theta_true_rad"],
    }  # fmt: skip


def test_where_there_is_a_new_value() -> None:
    published, recorded = np.array([True, False, False]), np.array([False, True, False])
    assert one("theta_measured_rad").fresh(published, recorded).tolist() == [True] * 3
    assert one("mode").fresh(published, recorded).tolist() == published.tolist()
    assert one("mode_recorded").fresh(published, recorded).tolist() == recorded.tolist()
    assert one("nis_recorded").fresh(published, recorded).tolist() == [True] * 3


def test_numbers_as_words(dbc: Any) -> None:
    for column, enum in (("mode", "lever_mode"), ("mode_recorded", "lever_mode"), ("bounce", "lever_bounce")):
        for number, name in enum_names(enum).items():
            assert words(column, number) == name
        assert words(column, 99) == ""
    for column in ("evidence", "verdict"):
        choices = dbc.get_message_by_name("TEST_RATIO").get_signal_by_name(column).choices
        for number, name in choices.items():
            assert words(column, number) == str(name)
    bits = {name: bit for bit, name in enum_names("lever_fault").items()}
    assert words("faults", bits["gap"] | bits["theta"]) == "theta, gap"
    assert words("faults", 0) == ""
    assert as_words("mode", np.array([2.0, np.nan, 0.0, 2.0])) == ["run", None, "init", "run"]


def test_times_from_2001_on_are_of_a_calendar() -> None:
    assert calendar(10**15 - 1) is None
    assert calendar(10**15) == datetime(2001, 9, 9, 1, 46, 40, tzinfo=timezone.utc)
    assert calendar(1_715_941_230_123_456) == datetime(2024, 5, 17, 10, 20, 30, 123456, tzinfo=timezone.utc)
