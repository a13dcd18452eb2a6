"""lever_cdkf.estimate() on frames and arrays of every library: the same result, units noticed, everything named."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import polars as pl
import pytest
import xarray as xr
from lever_cdkf import Config, Result, estimate, run_samples
from lever_cdkf.errors import LeverError
from lever_cdkf.report.printed import values
from lever_cdkf.signals import result_plot
from lever_cdkf.signals.arrays import signals_by_input
from lever_cdkf.signals.units import split_name
from PIL import Image
from pyarrow import parquet
from python.report.reading import Reader
from python.signals.flight import GRAVITY, NATURAL_FREQUENCY, Flight, fly

Columns = dict[str, Any]


@pytest.fixture(scope="module")
def flight() -> Flight:
    return fly(40.0)


@pytest.fixture(scope="module")
def columns(flight: Flight) -> Columns:
    return {"time": flight.time, "theta": flight.theta, "theta_dot": flight.theta_dot, "z_ddot": flight.z_ddot}


@pytest.fixture(scope="module")
def result(columns: Columns) -> Result:
    return estimate(columns)


def with_units(columns: Columns) -> xr.Dataset:
    degrees = ("time", np.degrees(columns["theta"]), {"units": "degrees"})
    values = {"theta": degrees, "theta_dot": ("time", columns["theta_dot"]), "z_ddot": ("time", columns["z_ddot"])}
    return xr.Dataset(values, coords={"time": columns["time"]})


FRAMES: dict[str, Callable[[Columns], Any]] = {
    "lists": lambda columns: {name: list(values) for name, values in columns.items()},
    "pandas": pd.DataFrame,
    "pandas with time as index": lambda columns: pd.DataFrame(columns).set_index("time"),
    "pandas with dates": lambda columns: (
        pd.DataFrame(columns)
        .set_index(pd.Timestamp("2024-05-01T10:00:00Z") + pd.to_timedelta(columns["time"], unit="s"))
        .drop(columns="time")
    ),
    "pandas with a column of dates": lambda columns: pd.DataFrame(columns).assign(
        time=pd.Timestamp("2024-05-01T10:00:00Z") + pd.to_timedelta(columns["time"], unit="s")
    ),
    "polars": pl.DataFrame,
    "xarray": with_units,
    "microseconds": lambda columns: {
        **{name: values for name, values in columns.items() if name != "time"},
        "time_us": np.rint(columns["time"] * 1e6).astype(np.int64),
    },
    "structured": lambda columns: pd.DataFrame(columns).to_records(index=False),
    "names with units": lambda columns: {
        "time": columns["time"],
        "theta_deg": np.degrees(columns["theta"]),
        "theta_dot [deg/s]": np.degrees(columns["theta_dot"]),
        "z_ddot (g)": columns["z_ddot"] / GRAVITY,
    },
}


@pytest.mark.parametrize("kind", FRAMES)
def test_whatever_holds_the_samples(kind: str, columns: Columns, result: Result) -> None:
    other = estimate(FRAMES[kind](columns))
    assert other["natural_frequency"].last == pytest.approx(result["natural_frequency"].last, rel=1e-4)
    assert set(other) == set(result)
    assert len(other) == len(set(other)) == 7
    assert len(other.time) == len(columns["time"])


def test_it_is_right_and_equal_to_the_samples_fed_directly(columns: Columns, result: Result) -> None:
    assert result["natural_frequency"].last == pytest.approx(NATURAL_FREQUENCY, rel=0.02)
    time_us = np.rint(columns["time"] * 1e6).astype(np.int64)
    raw = {"time_us": time_us, **{name: columns[name] for name in ("theta", "theta_dot", "z_ddot")}}
    direct = run_samples(Config(settings={"sample_period": 2e-3}), raw)
    assert result["natural_frequency"].last == direct["natural_frequency"][-1]
    assert result["m_p"].last == direct["parameter"][-1, 0]
    assert result["c_p"].last_sigma == direct["parameter_sigma"][-1, 1]
    assert result.config.settings["sample_period"] == 2e-3


@pytest.mark.parametrize("name", ["theta", "theta_dot"])
def test_small_degrees_are_seen_in_samples_fed_directly(name: str, columns: Columns) -> None:
    time_us = np.rint(columns["time"] * 1e6).astype(np.int64)
    little = {each: 0.1 * (columns[each] - np.mean(columns[each])) for each in ("theta", "theta_dot")}
    raw = {"time_us": time_us, "z_ddot": 0.1 * columns["z_ddot"], **little, name: np.degrees(little[name])}
    with pytest.raises(LeverError, match=f"slope of theta: {name} looks like degrees: numpy.radians"):
        run_samples(Config(settings={"sample_period": 2e-3}), raw)


def test_units_that_are_said(columns: Columns, result: Result) -> None:
    said = {
        "t": 1e3 * columns["time"],
        "theta": np.degrees(columns["theta"]),
        "theta_dot": np.degrees(columns["theta_dot"]),
        "z_ddot": 1.0 + columns["z_ddot"] / GRAVITY,
    }
    units = {"time": "ms", "theta": "deg", "theta_dot": "deg/s", "z_ddot": "g"}
    other = estimate(said, units=units)
    assert other["natural_frequency"].last == pytest.approx(result["natural_frequency"].last, rel=1e-4)
    assert ["gravity" in note for note in other.notes] == [True]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"theta": np.degrees}, r"looks like degrees: units=\{'theta': 'deg'\}"),
        ({"theta_dot": np.degrees}, r"theta_dot looks like degrees: units=\{'theta_dot': 'deg/s'\}"),
        ({"z_ddot": lambda values: 1.0 + values / GRAVITY}, r"gravity in g: it looks like g: units=\{'z_ddot': 'g'\}"),
        ({"time": lambda values: 1e3 * values}, r"looks like ms: units=\{'time': 'ms'\}"),
        ({"time": lambda values: 20.0 * values}, "the firmware takes samples from 50 to 10000 Hz"),
        ({"theta": lambda values: values[:-1]}, r"theta has 19999 values, time has 20000"),
        ({"theta": lambda values: values * np.nan, "theta_dot": lambda values: values * np.nan}, "one of theta and"),
    ],
)
def test_what_is_noticed(change: dict[str, Callable[[Any], Any]], said: str, columns: Columns) -> None:
    changed = {name: change.get(name, lambda each: each)(values) for name, values in columns.items()}
    with pytest.raises(LeverError, match=said):
        estimate(changed)


@pytest.mark.parametrize("unit", ["s", "ms"])
def test_rows_that_are_not_in_order_of_time_say_so_first(unit: str, columns: Columns) -> None:
    backwards = {name: values[::-1] for name, values in columns.items()}
    backwards["time"] = backwards["time"] * {"s": 1.0, "ms": 1e3}[unit]
    with pytest.raises(LeverError, match="time goes back in 19,999 of 20,000 rows: sort by time"):
        estimate(backwards)


@pytest.mark.parametrize(
    ("samples", "options", "said"),
    [
        (3, {}, "samples are a int: give a frame"),
        ({"theta": [1.0]}, {}, "no column of time"),
        ({"time": [0.0, 1e-3], "theta": [0.1, 0.1]}, {}, "z_ddot and one of theta and theta_dot are needed"),
        ({"time": [0.0, 1e-3], "theta": [0.1, 0.1]}, {"units": {"angle": "deg"}}, "units of angle"),
        ({"time": [0.0, 1e-3], "a": [0.1, 0.1]}, {"names": {"theta": "b"}}, "names: theta = b"),
    ],
)
def test_what_is_refused(samples: Any, options: Any, said: str) -> None:
    with pytest.raises(LeverError, match=said):
        estimate(samples, **options)


def test_what_is_of_another_kind_is_refused_in_words(columns: Columns) -> None:
    frame = pd.DataFrame(columns)
    for options, said in (
        ({"config": "lever"}, "config is a str: give a Config"),
        ({"units": 5}, "units = 5: give them by input"),
        ({"names": "theta"}, "names = 'theta': give them by input"),
    ):
        with pytest.raises(LeverError, match=said):
            estimate(frame, **options)
    for text in (frame.astype(str), frame.astype(object), frame.astype("string")):
        with pytest.raises(LeverError, match="time is no column of numbers"):
            estimate(text)
    with pytest.raises(LeverError, match="settings = 5: give values by name"):
        Config(settings=5)  # type: ignore[arg-type]
    with pytest.raises(LeverError, match="config is a str: give a Config"):
        run_samples("lever", {})  # type: ignore[arg-type]


def test_other_names_and_settings(columns: Columns) -> None:
    renamed = {"Zeit": columns["time"], "winkel": columns["theta"], "nz": columns["z_ddot"]}
    names = {"theta": "winkel", "z_ddot": "nz"}
    estimated = estimate(renamed, Config(model="linear_physical"), names=names)
    assert list(estimated)[:3] == ["m", "c", "k"]


def test_missing_values_are_missing(columns: Columns) -> None:
    holes = {**columns, "tau_m": np.full(len(columns["time"]), math.nan), "theta": columns["theta"].copy()}
    holes["theta"][::7] = math.nan
    estimated = estimate(holes)
    assert "theta" in estimated.flags[7]
    assert "tau" not in " ".join(estimated.notes)
    assert estimated["natural_frequency"].last == pytest.approx(NATURAL_FREQUENCY, rel=0.02)


def test_everything_has_its_name(result: Result, tmp_path: Path) -> None:
    assert list(result) == ["m_p", "c_p", "k_p", "natural_frequency", "damping_ratio", "theta", "theta_dot"]
    assert [result[name].unit for name in list(result)[:4]] == ["kg", "N s/m", "N/m", "Hz"]
    assert result.mode[-1] == "run"
    assert "torque" in result.flags[-1]
    assert np.isnan(result["k_p"].values[0])
    for shown in (repr(result), result._repr_html_()):
        assert "natural_frequency" in shown
        assert f"{result['natural_frequency'].last:.4g}" in shown
        assert "20000 samples in 40 s" in shown
    result.to_parquet(tmp_path / "estimates.parquet")
    table = parquet.read_table(tmp_path / "estimates.parquet")
    assert table.schema.field("k_p_sigma").metadata == {b"unit": b"N/m"}
    assert table["flags"][-1].as_py() == result.flags[-1]
    metadata = table.schema.metadata
    assert metadata[b"library"].startswith(b"sha256:")
    assert json.loads(metadata[b"estimator"])["settings"]["sample_period"] == pytest.approx(0.002)
    np.testing.assert_array_equal(table["damping_ratio"].to_numpy(), result["damping_ratio"].values)
    with pytest.raises(LeverError, match="cannot write"):
        result.to_parquet(tmp_path / "nowhere/estimates.parquet")
    with pytest.raises(KeyError, match="there are m_p"):
        _ = result["mass"]


def test_the_plot_shows_the_last_estimates(result: Result) -> None:
    figure = result.plot()
    assert figure.get_size_inches() == pytest.approx([180.0 / 25.4, 0.5 + 1.2 * 5])
    labels = [axis.get_ylabel() for axis in figure.axes]
    assert labels == [
        *("$m_{p}$\n[kg]", "$c_{p}$\n[N s/m]", "$k_{p}$\n[N/m]"),
        *("natural_frequency\n[Hz]", "damping_ratio"),
    ]
    low, high = figure.axes[3].get_ylim()
    assert low < NATURAL_FREQUENCY < high
    assert figure.axes[0].get_title() == "lever model, dual estimator"
    assert [text.get_text() for text in figure.legends[0].get_texts()] == [
        "estimate ± 2 standard deviations", "estimate"
    ]  # fmt: skip


def test_the_band_ends_where_a_quantity_cannot_be(result: Result) -> None:
    """A mass is not negative, whatever its standard deviation."""
    doubtful = replace(result["m_p"], sigma=10.0 * result["m_p"].values)
    figure = result_plot.figure(result.time, [doubtful, replace(doubtful, least=-math.inf)])
    floors = [float(values(trace["y"]).min()) for trace in figure.traces if not trace["line"]["width"]][::2]
    assert floors[0] == 0.0
    assert floors[-1] < -10.0


@pytest.mark.parametrize("kind", ["pdf", "svg", "png"])
def test_the_plot_is_kept_with_its_numbers(kind: str, result: Result, tmp_path: Path) -> None:
    path = tmp_path / f"Schätzung 推定.{kind}"
    result.plot(path, width="single")
    assert path.read_bytes().startswith({"pdf": b"%PDF", "svg": b"<?xml", "png": b"\x89PNG"}[kind])
    if kind == "png":
        with Image.open(path) as image:
            assert image.width == int(88 / 25.4 * 300)
    table = pd.read_csv(path.with_suffix(".csv"))
    assert table["natural_frequency [Hz]"].iloc[-1] == pytest.approx(NATURAL_FREQUENCY, rel=0.02)
    assert len(table.columns) == 1 + 2 * 5


def test_a_plot_that_cannot_be_kept_is_an_error(result: Result, tmp_path: Path) -> None:
    with pytest.raises(LeverError, match="cannot plot with width = 'wide': it may be single or double"):
        result.plot(tmp_path / "estimates.pdf", width="wide")
    with pytest.raises(LeverError, match=r"estimates\.gif: a plot may be \.png, \.svg, \.pdf"):
        result.plot(tmp_path / "estimates.gif")
    with pytest.raises(LeverError, match="cannot write"):
        result.plot(tmp_path / "nowhere/estimates.pdf")
    assert list(tmp_path.iterdir()) == []


# --- what a result shows ---------------------------------------------------------------------------------------------


def test_a_result_shows_each_quantity_with_its_sigma_and_unit(result: Result) -> None:
    shown = [name for name in result if not name.startswith("theta")]
    lines = repr(result).splitlines()
    assert lines[0] == f"lever, dual: 20000 samples in 40 s, run at the end, flags: {result.flags[-1]}"
    assert len(lines) == 1 + len(shown)
    for line, name in zip(lines[1:], shown, strict=True):
        each = result[name]
        unit = "" if name == "damping_ratio" else f" {each.unit}"
        assert line == f"  {name} = {each.values[-1]:.4g} ± {each.sigma[-1]:.2g}{unit}"
    page = Reader(result._repr_html_())
    assert page.text[0] == lines[0]
    (table,) = page.tables
    assert table == [
        ["quantity", "at the end", "σ", "unit"],
        *(
            [name, f"{result[name].last:.4g}", f"± {result[name].last_sigma:.2g}", result[name].unit.removeprefix("1")]
            for name in shown
        ),
    ]
    assert result._repr_html_().count("<li>") == len(result.notes)
    np.testing.assert_array_equal(np.asarray(result["m_p"]), result["m_p"].values)
    assert np.asarray(result["m_p"], dtype=np.float32).dtype == np.float32


def test_columns_of_a_result_have_their_units(result: Result) -> None:
    columns = result.columns()
    quantities = [name for each in result for name in (each, f"{each}_sigma")]
    assert list(columns) == ["time", *quantities, "nis", "mode", "flags"]
    units = {name: unit for name, (_, unit) in columns.items()}
    assert (units["time"], units["nis"], units["mode"], units["flags"]) == ("s", "1", "", "")
    assert [units[name] for name in ("theta", "theta_dot_sigma", "damping_ratio")] == ["rad", "rad/s", "1"]
    assert result.time[0] == 0.0
    assert result.time[-1] == pytest.approx(39.998)
    aligning = np.isin(result.mode, ("init", "align"))
    assert aligning[0]
    assert np.isnan(columns["theta"][0][aligning]).all()
    assert np.isfinite(columns["theta"][0][~aligning]).all()
    assert set(result.mode) <= {"init", "align", "run", "coast"}


def test_axes_and_table_of_the_plot(result: Result) -> None:
    shown = [replace(result["natural_frequency"], values=np.linspace(2.0, 3.0, 1001), sigma=np.full(1001, 0.1))]
    shown.append(replace(result["damping_ratio"], values=np.full(1001, 0.01), sigma=np.full(1001, 0.1)))
    shown.append(replace(result["m_p"], values=np.full(1001, np.nan), sigma=np.full(1001, np.nan)))
    time = np.linspace(0.0, 5.0, 1001)
    figure = result_plot.figure(time, shown)
    layout = figure.spec()["layout"]
    assert layout["xaxis"]["title"]["text"] == "time [s]"
    assert layout["xaxis"]["range"] == [0.0, 5.0]
    assert layout["yaxis"]["range"] == pytest.approx([2.01 - 0.49, 2.99 + 0.49])  # half of what 98 % of it spans
    assert layout["yaxis2"]["range"] == pytest.approx([0.0, 0.41])  # four sigma, but nothing below what can be
    assert "range" not in layout["yaxis3"]
    assert [trace["name"] for trace in figure.traces if trace["line"]["width"]] == ["estimate"] * 3
    lines = result_plot.table(time, shown).splitlines()
    assert lines[0] == (
        "time [s],natural_frequency [Hz],natural_frequency_sigma [Hz],damping_ratio [1],damping_ratio_sigma [1],"
        "m_p [kg],m_p_sigma [kg]"
    )
    assert lines[1] == "0,2,0.1,0.01,0.1,,"
    assert len(lines) == 1002


@pytest.mark.parametrize(
    ("name", "key"),
    [("theta_deg", "theta"), ("theta [deg]", "theta"), ("theta", "theta"), ("theta_dot_deg_s", "theta_dot"),
     ("z_ddot_m_s2", "z_ddot"), ("tau_m (N m)", "tau_m"), ("grip_force_N", "grip_force"), ("z_ddot_g", "z_ddot")],
)  # fmt: skip
def test_a_column_may_have_its_unit_in_its_name(name: str, key: str) -> None:
    columns = {"time": (np.arange(3.0) * 1e-3, ""), name: (np.arange(3.0), split_name(name)[1])}
    found = signals_by_input(columns, {})
    assert list(found) == [key]
    assert found[key].name == name
    assert found[key].unit.replace("N m", "Nm") == split_name(name)[1].replace("N m", "Nm")
    assert signals_by_input(columns, {key: "other"})[key].unit == "other"


@pytest.mark.parametrize("name", ["theta_max", "my_theta", "thetas_deg", "theta_dot_max"])
def test_other_columns_are_no_inputs(name: str) -> None:
    assert signals_by_input({"time": (np.arange(3.0) * 1e-3, ""), name: (np.arange(3.0), "")}, {}) == {}


def test_columns_that_are_no_numbers() -> None:
    columns = {"time": (np.arange(3.0) * 1e-3, ""), "theta": (np.array(["a", "b", "c"]), "")}
    with pytest.raises(LeverError, match=r"^theta is no column of numbers$"):
        signals_by_input(columns, {})
    with pytest.raises(
        LeverError, match=r"^time goes on by 2 s a sample, in s: units=\{'time': …\} says what it is in"
    ):
        signals_by_input({"time": (np.arange(3.0) * 2.0, "s")}, {})
