"""The binding: façade structs and enums, configurations, and instances that do not disturb each other."""

from __future__ import annotations

import math
import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import polars
import pytest
from lever_cdkf.can import codec
from lever_cdkf.errors import LeverError, SettingsError
from lever_cdkf.firmware import native, quantities
from lever_cdkf.firmware.native import Config, Estimator, lib
from lever_cdkf.runtime.files import LIBRARY_DIR, native_file

QUICK = Config(settings={"align_time": 0.05})
DEFAULTS = {
    "model": "lever",
    "preload": "trim",
    "estimator": "dual",
    "adaptation": "robbins_monro",
    "mitigation": "none",
}


def recording(count: int, seed: int = 0) -> dict[str, Any]:
    """Return samples of a swinging lever at 1 kHz, a tenth of them without theta."""
    random = np.random.default_rng(seed)
    time = np.arange(count) * 1e-3
    theta = 0.35 + 0.02 * np.sin(2.0 * np.pi * 3.0 * time) + 1e-3 * random.standard_normal(count)
    theta[random.random(count) < 0.1] = np.nan
    return {
        "time_us": np.arange(count) * 1000,
        "theta": theta,
        "theta_dot": 0.38 * np.cos(2.0 * np.pi * 3.0 * time) + 1e-2 * random.standard_normal(count),
        "tau_m": 0.3 * random.standard_normal(count),
        "z_ddot": np.sin(2.0 * np.pi * 2.0 * time),
    }


def feed(estimator: Estimator, samples: dict[str, Any], index: int) -> str:
    """Return one sample of a recording; NaN is missing."""
    values = {name: float(samples[name][index]) for name in ("theta", "theta_dot", "tau_m", "z_ddot")}
    present: dict[str, Any] = {name: None if math.isnan(value) else value for name, value in values.items()}
    return estimator.update(int(samples["time_us"][index]), **present)


# --- the façade as cffi reads it -------------------------------------------------------------------------------------


def test_all_that_it_says_to_offer_is_there() -> None:
    """Else `from lever_cdkf.firmware.native import *` is an error."""
    assert set(native.__all__) - set(dir(native)) == set()


def test_settings_table_is_the_definition(root: Path) -> None:
    text = (root / "firmware/lever_settings.def").read_text(encoding="utf-8")
    pattern = r'^LEVER_SETTING\((\w+), "(.*?)", (\S+)f, (\S+)f, (\S+)f, "(.*)"\)$'
    expected = [
        (name, unit, float(default), float(least), float(greatest), meaning)
        for name, unit, default, least, greatest, meaning in re.findall(pattern, text, re.MULTILINE)
    ]
    rows = native.settings_table()
    assert len(rows) == text.count("\nLEVER_SETTING(")
    assert [(row.name, row.unit, row.meaning) for row in rows] == [row[:2] + row[5:] for row in expected]
    numbers = np.array([(row.default, row.least, row.greatest) for row in rows], np.float32)
    np.testing.assert_array_equal(numbers, np.array([row[2:5] for row in expected], np.float32))


def test_parameters_of_every_model_are_those_on_the_bus() -> None:
    """Against lever.dbc; names and units are the firmware's."""
    message = codec.message("PILOT_PARAMETERS")
    for number, model in native.enum_names("lever_model").items():
        on_bus = [(signal.name, signal.unit) for signal in message.signals if signal.multiplexer_ids == [number]]
        assert [tuple(parameter) for parameter in native.model_parameters(model)] == on_bus
    with pytest.raises(SettingsError, match="model = 'arm' is not known; allowed: lever, linear_physical, linear_b"):
        native.model_parameters("arm")


# --- configuration ---------------------------------------------------------------------------------------------------


def test_every_parameter_has_words_and_only_those_of_the_black_box_are_signed() -> None:
    for model in native.enum_names("lever_model").values():
        for each in quantities.parameters(model):
            assert each.name != each.key
            assert each.signed is (model == "linear_black_box")


def test_choices_and_settings_reach_the_firmware() -> None:
    config = Config(preload="fixed", adaptation="annealing", settings={"theta_noise": 2e-3, "m_p": 3})
    assert config.choices == {**DEFAULTS, "preload": "fixed", "adaptation": "annealing"}
    assert config.pointer.preload == lib.LEVER_PRELOAD_FIXED
    assert config.pointer.settings.theta_noise == float(np.float32(2e-3))
    assert config.settings["m_p"] == 3.0
    assert Estimator(config).estimate().parameter[0] == pytest.approx(3.0, rel=1e-5)


@pytest.mark.parametrize("row", native.settings_table(), ids=lambda row: str(row.name))
def test_range_of_every_setting(row: native.Setting) -> None:
    numbers: list[Any] = [row.least, row.greatest, row.default, np.float32(row.least), np.float64(row.greatest)]
    for number in numbers:
        row.check(number)
    below = row.least - max(abs(row.least), 1e-6) * 1e-3
    for value in (below, row.greatest * 1.001, math.inf, -math.inf, math.nan, 1e60):
        with pytest.raises(SettingsError) as caught:
            Config(settings={row.name: value})
        line = str(caught.value)
        assert line.startswith(f"{row.name} = {value} is out of range: it must be a number from ")
        assert f"{row.least:g} to {row.greatest:g} {row.unit} (" in line
        assert "\n" not in line


def test_configuration_changed_behind_its_back() -> None:
    config = Config()
    config.pointer.settings.m_p = -1.0
    with pytest.raises(LeverError, match="refused its configuration"):
        Estimator(config)


# --- one instance ----------------------------------------------------------------------------------------------------


def test_commands() -> None:
    estimator = Estimator(QUICK)
    for k in range(200):
        estimator.update(1000 * k, 0.35, 0.0, 0.0, 0.0)
    estimator.command("freeze", dither_rms=0.3)
    assert estimator.update(200_000, 0.35, 0.0, 0.0, 0.0) == "frozen"
    estimator.command("run", adaptation="fixed")
    assert estimator.update(201_000, 0.35, 0.0, 0.0, 0.0) == "run"
    with pytest.raises(LeverError, match="request = 'stop' is not known; allowed: none, run, freeze, reset"):
        estimator.command("stop")
    with pytest.raises(LeverError, match="preload = 'loose' is not known"):
        estimator.command(preload="loose")
    with pytest.raises(LeverError, match="refused the command 'none', dither_rms = nan N m"):
        estimator.command(dither_rms=math.nan)


def test_frames_give_what_samples_give(samples: Callable[[int, int], Any]) -> None:
    by_frames, by_samples = Estimator(), Estimator()
    for k, ((_, motion), (_, base)) in enumerate(samples(0, 400)):
        assert by_frames.on_frame(0x110, motion) == lib.LEVER_FRAME_TAKEN
        assert by_frames.on_frame(0x111, base) == native.FRAME_SAMPLE
        assert native.enum_names("lever_mode")[by_frames.step()] == by_frames.health().mode
        theta, theta_dot, tau_m = np.frombuffer(motion[2:], "<i2")
        z_ddot = np.frombuffer(base[2:4], "<i2")[0]
        by_samples.update(1000 * k, theta / 10000, theta_dot / 2000, tau_m / 1000, z_ddot / 1000)
        assert by_frames.estimate() == by_samples.estimate()
        frames = list(iter(by_frames.next_frame, None))
        assert frames[-1][0] == 0x210
        assert all(len(data) == 8 for _, data in frames)
    assert by_frames.next_frame() is None


def test_frames_that_are_not_for_the_firmware() -> None:
    estimator = Estimator()
    assert estimator.on_frame(0x7FF, b"") == lib.LEVER_FRAME_IGNORED
    assert estimator.on_frame(0x111, bytes(7)) == lib.LEVER_FRAME_REFUSED
    assert estimator.health().corrupt == 1
    estimator.step()
    assert estimator.next_frame() is None
    with pytest.raises(LeverError, match="frame 0x111 has 9 bytes; a classic CAN frame has at most 8"):
        estimator.on_frame(0x111, bytes(9))


# --- many instances, whole recordings --------------------------------------------------------------------------------


@pytest.mark.parametrize("estimator", native.enum_names("lever_estimator").values())
@pytest.mark.parametrize("model", native.enum_names("lever_model").values())
def test_run_samples_is_the_loop(model: str, estimator: str) -> None:
    config, samples = Config(model=model, estimator=estimator, settings={"align_time": 0.1}), recording(300)
    columns = native.run_samples(config, samples)
    instance = Estimator(config)
    for index in range(300):
        mode = feed(instance, samples, index)
        for name, value in instance.estimate()._asdict().items():
            np.testing.assert_array_equal(columns[name][index], np.asarray(value, columns[name].dtype))
        assert native.enum_names("lever_mode")[columns["mode"][index]] == mode
        assert native.fault_names(columns["faults"][index]) == instance.health().faults
    assert columns["parameter"].shape == columns["parameter_correlation"].shape == (300, 3)
    assert columns["theta"].dtype == np.float32


def test_run_samples_wraps_time() -> None:
    samples = recording(300)
    expected = native.run_samples(None, samples)
    for start in (2**32 - 50_000, 7 * 2**32, 7.0 * 2**32):
        columns = native.run_samples(None, {**samples, "time_us": samples["time_us"] + start})
        np.testing.assert_array_equal(columns["parameter"], expected["parameter"])
        assert columns["time_us"].tolist() == [(1000 * k + start) % 2**32 for k in range(300)]


def test_run_samples_with_flags() -> None:
    samples = recording(200)
    samples["theta"] = np.nan_to_num(samples["theta"])
    samples["theta_valid"] = np.arange(200) % 2 == 0
    del samples["tau_m"]
    columns = native.run_samples(None, samples)
    np.testing.assert_array_equal(columns["faults"] & lib.LEVER_FAULT_THETA != 0, ~samples["theta_valid"])
    assert np.all(columns["faults"] & lib.LEVER_FAULT_TORQUE)
    assert native.run_samples(None, {"time_us": np.empty(0)})["theta"].shape == (0,)


@pytest.mark.parametrize("column", [list, polars.Series, lambda values: values.astype(np.float32)])
def test_run_samples_takes_any_column_of_numbers(column: Any) -> None:
    samples = recording(200)
    given = {name: column(values) if name != "time_us" else values for name, values in samples.items()}
    if column is polars.Series:
        given = dict(polars.DataFrame(samples).with_columns(polars.col("theta").fill_nan(None)).to_dict())
    columns, expected = native.run_samples(None, given), native.run_samples(None, samples)
    np.testing.assert_array_equal(columns["parameter"], expected["parameter"])


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"time_us": np.arange(200) * 1e-3}, "time_us is 0.001 at index 1; it must be whole numbers, of microseconds"),
        (
            {"time_us": np.arange(200)},
            "time_us goes on by 1 a sample, and sample_period is 1000 µs: is it in microseco",
        ),
        ({"time_us": np.arange(200) * 10**6}, "time_us goes on by 1e+06 a sample, and sample_period is 1000 µs: is it"),
        ({"time_us": np.zeros(200)}, "time_us goes on by 0 a sample"),
        ({"time_us": np.full(200, np.nan)}, "time_us is nan at index 0"),
        (
            {"theta": np.degrees(recording(200)["theta"])},
            "theta is beyond ±3.14 rad in 100 % of them: is it in degrees",
        ),
        ({"theta_dot": np.degrees(recording(200)["theta_dot"])}, "theta_dot is beyond ±20 rad/s in "),
        ({"z_ddot": np.zeros(199)}, "samples: z_ddot has 199 values, time_us has 200"),
        ({"theta_valid": np.ones(3, np.bool_)}, "samples: theta_valid has 3 values, time_us has 200"),
        ({"z_ddot": np.zeros((200, 1))}, "samples: z_ddot has 2 dimensions; it must be one column"),
        ({"theta": polars.Series(["0.3"] * 200)}, "samples: theta is no column of numbers"),
        ({"theta": np.ones(200, np.bool_)}, "samples: theta is no column of numbers"),
        ({"z_ddot": np.full(200, 1e300)}, "samples: z_ddot is 1e+300 at index 0: more than a float holds"),
        ({"z_ddot": np.full(200, -np.inf)}, "samples: z_ddot is -inf at index 0: NaN is missing"),
        ({"tau": np.zeros(200)}, "unknown columns of samples: tau; they may be time_us, theta, "),
    ],
)
def test_run_samples_says_what_is_wrong_with_them(wrong: dict[str, Any], message: str) -> None:
    with pytest.raises(LeverError, match=re.escape(message)) as caught:
        native.run_samples(None, recording(200) | wrong)
    assert "\n" not in str(caught.value)


def test_run_samples_takes_columns_not_tables() -> None:
    with pytest.raises(LeverError, match="samples are a DataFrame: give its columns, as "):
        native.run_samples(None, polars.DataFrame(recording(200)))  # type: ignore[arg-type]
    with pytest.raises(LeverError, match="samples have no column time_us"):
        native.run_samples(None, {"theta": np.zeros(3)})


def test_run_samples_takes_outliers_for_what_they_are() -> None:
    """A spike is the firmware's to judge, not another unit: up to one in a hundred."""
    samples = recording(1000)
    samples["theta"][500:505] = 20.0
    assert native.run_samples(None, samples)["theta"].shape == (1000,)
    samples["theta"][500:513] = 20.0
    with pytest.raises(LeverError, match="theta is beyond"):
        native.run_samples(None, samples)


@pytest.mark.parametrize(("step_us", "taken"), [(34, True), (33, False), (29_999, True), (30_001, False)])
def test_run_samples_takes_a_step_of_another_size_but_not_of_another_unit(step_us: int, taken: bool) -> None:
    """A thirtieth of sample_period to thirty of it."""
    samples = {"time_us": step_us * np.arange(10), "theta": np.zeros(10)}
    if taken:
        assert native.run_samples(None, samples)["theta"].shape == (10,)
    else:
        with pytest.raises(LeverError, match="is it in microseconds"):
            native.run_samples(None, samples)


# --- loading ---------------------------------------------------------------------------------------------------------


def test_a_library_that_cannot_be_loaded(tmp_path: Path) -> None:
    (tmp_path / "liblever_cdkf.so").write_text("not a library")
    environment = {**os.environ, LIBRARY_DIR: f"{tmp_path}{os.pathsep}{os.environ.get(LIBRARY_DIR, '')}"}
    command = [sys.executable, "-m", "lever_cdkf.cli.main", "settings"]
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    assert done.returncode == 2
    assert done.stdout == ""
    assert re.fullmatch(r"lever: error: cannot load .*/liblever_cdkf\.so: .*\n", done.stderr)


def test_a_file_that_is_not_there(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv(LIBRARY_DIR, str(tmp_path))
    with pytest.raises(LeverError, match=rf"nothing.so is not in {tmp_path}, .*_native: install the package") as caught:
        native_file("nothing.so")
    assert "\n" not in str(caught.value)
