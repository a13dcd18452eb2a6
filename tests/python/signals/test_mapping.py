"""What is which input: the text of a mapping and its file, names and units of columns, times, and errors in a line."""

from __future__ import annotations

import argparse
import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from lever_cdkf.commands import options
from lever_cdkf.errors import LeverError
from lever_cdkf.signals.clock import RunningClock
from lever_cdkf.signals.mapping import Mapping, Protection, Source, as_toml, read_mapping, time_column
from lever_cdkf.signals.reading import column
from lever_cdkf.signals.recorded import Signal, ordered
from lever_cdkf.signals.tables import find_time, read_table, seconds, time_scale
from lever_cdkf.signals.units import INPUTS, KINDS, factor, fitting, is_unit, likely, split_name

ANY = ("theta=a", "z_ddot=b")

# --- the text of a mapping -------------------------------------------------------------------------------------------


def source_of(text: str, key: str = "z_ddot") -> Source:
    return read_mapping([*ANY, f"{key}={text}"]).sources[key]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("IMU.z", Source("IMU.z")),
        (" IMU.z ", Source("IMU.z")),
        ("z,unit=g", Source("z", unit="g")),
        ("z,factor=0.5", Source("z", factor=0.5)),
        ("z,offset=-2", Source("z", offset=-2.0)),
        ("z,offset=2 g", Source("z", offset=2.0 * 9.80665)),
        ("z,sign=-1", Source("z", sign=-1)),
        ("z,sign=+1", Source("z", sign=1)),
        ("z,gravity=none", Source("z", gravity="none")),
        ("z,channel=can 1", Source("z", channel="can 1")),
        ("z,delay=0.25", Source("z", delay=0.25)),
        ("z,delay=-4 ms", Source("z", delay=-0.004)),
        ("z,delay=1", Source("z", delay=1.0)),
        ("acc, down,unit=g,sign=-1", Source("acc, down", unit="g", sign=-1)),
        ("z,other=3", Source("z,other=3")),
    ],
)
def test_options_follow_the_signal(text: str, expected: Source) -> None:
    assert source_of(text) == expected


def test_an_offset_is_in_the_unit_of_its_input() -> None:
    assert source_of("a,offset=90 deg", "theta").offset == pytest.approx(math.pi / 2.0)
    assert source_of("a,offset=1 lbf ft", "tau_m").offset == pytest.approx(4.4482216152605 * 0.3048)


@pytest.mark.parametrize(
    ("entries", "said"),
    [
        (("theta=a",), "the mapping has no z_ddot, the acceleration of the base: give --map z_ddot=MESSAGE.SIGNAL"),
        (("z_ddot=a",), "the mapping has neither theta nor theta_dot: give --map theta=MESSAGE.SIGNAL"),
        ((*ANY, "tau=c"), "--map tau: did you mean tau_m? the inputs are theta, theta_dot, z_ddot, tau_m, "),
        ((*ANY, "xyz=c"), "--map xyz: no such input; the inputs are "),
        ((*ANY, "theta="), "--map theta=: the signal is missing: give MESSAGE.SIGNAL, or the column of a file"),
        ((*ANY, "theta=a,unit=deg,factor=2"), "mapping of theta: a unit and a factor: give one of them"),
        ((*ANY, "theta=a,gravity=included"), "mapping of theta: gravity is of z_ddot alone"),
        ((*ANY, "theta=a,delay=1.1"), "mapping of theta: delay = 1.1 s is more than a second: it is in seconds"),
        ((*ANY, "theta=a,offset=x"), "mapping of theta: offset = x; it must be a number, in rad or with a unit of"),
        ((*ANY, "theta=a,factor=inf"), "mapping of theta: factor = inf; it must be a number"),
        ((*ANY, "theta=a,unit=N"), "mapping of theta: N is no unit of angle known here: give factor=, to rad"),
        ((*ANY, "x.csv"), "--map x.csv: it is neither KEY=MESSAGE.SIGNAL nor a .toml file"),
        ((*ANY, "time=t,unit=m"), "mapping of time: m is no unit of time known here: s, ms, us, ns"),
        ((*ANY, "time=t,sign=1"), "mapping of time: it may have a unit, and not sign"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_an_entry(entries: tuple[str, ...], said: str) -> None:
    with pytest.raises(LeverError) as error:
        read_mapping(entries)
    assert str(error.value).startswith(said)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('theta = "a"', 'mapping of theta: it needs a signal, as in [theta] signal = "Angle"'),
        ('[theta]\nunit = "deg"', 'mapping of theta: it needs a signal, as in [theta] signal = "Angle"'),
        ('[theta]\nsignal = "a"\nscale = 2', "mapping of theta: unknown scale; it may have message, signal, unit, "),
        ('[theta]\nsignal = "a"\nfactor = true', "mapping of theta: factor = True; it must be a number"),
        ("protected = 3", "protected is a table of messages, as in [protected.MESSAGE]"),
        ("[protected]\nM = 3", "mapping of [protected.M]: it may have profile, data_id and counter"),
        ("[protected.M]\nprofil = 1", "mapping of [protected.M]: it may have profile, data_id and counter, not profil"),
        ("[protected.M]\nprofile = 1.5", "[protected.M]: profile and data_id are whole numbers"),
        ("[protected.M]\nprofile = 1\ndata_id = true", "[protected.M]: profile and data_id are whole numbers"),
        ("[protected.M]\ncounter = 3", "mapping of [protected.M]: counter is the name of a signal"),
        ("[protected.M]\ndata_id = 3", "mapping of [protected.M]: it has neither a profile nor a counter"),
        ("[protected.M]\nprofile = 4", "mapping of [protected.M]: profile = 4; it may be 1, 2 or 5"),
        ("[protected.M]\nprofile = 2\ndata_id = 7", "[protected.M]: data_id is a list of sixteen bytes"),
        ("[protected.M]\nprofile = 2\ndata_id = [1, 2]", "[protected.M]: data_id is a list of sixteen bytes"),
        ("[protected.M]\nprofile = 1\ndata_id = [1, 2]", "[protected.M]: data_id is a list of sixteen bytes"),
        (f"[protected.M]\nprofile = 2\ndata_id = {[256] * 16}", "[protected.M]: data_id is a list of sixteen bytes"),
        ("[protected.M]\nprofile = 1\ndata_id = 65536", "[protected.M]: data_id is a list of sixteen bytes"),
        ("[protected.M]\nprofile = 5\ndata_id = -1", "and a number from 0 to 65535 for the others"),
        ("time = 3", 'mapping of time: it needs a column, as in time = "t"'),
        ('[time]\nsignal = "t"\nunit = 3', 'mapping of time: it needs a column, as in time = "t"'),
        ("[theta", "m.toml: not TOML: "),
    ],
)  # fmt: skip
def test_what_is_wrong_with_a_file(text: str, said: str, tmp_path: Path) -> None:
    file = tmp_path / "m.toml"
    file.write_text(text)
    with pytest.raises(LeverError) as error:
        read_mapping([*ANY, str(file)])
    assert said in str(error.value)


def test_a_mapping_is_read_back_from_its_file(tmp_path: Path) -> None:
    whole = Mapping(
        {
            "theta": Source('A "b" \\c', "mrad", None, -0.5, -1, "auto", "can 1", 0.004),
            "z_ddot": Source("z", factor=0.25, gravity="included"),
        },
        {
            "M": Protection(1, 0x1A2, "Counter"), "of two": Protection(2, tuple(range(16))),
            "N": Protection(None, 0, "C"), "P": Protection(5, 65535),
        },
        "t", "ms",
    )  # fmt: skip
    (tmp_path / "m.toml").write_text(as_toml(whole))
    assert read_mapping([str(tmp_path / "m.toml")]) == whole
    plain = replace(whole, time=None, time_unit="", protected={})
    (tmp_path / "plain.TOML").write_text(as_toml(plain))
    assert read_mapping([str(tmp_path / "plain.TOML")]) == plain
    assert "protected" not in as_toml(plain)


def test_later_entries_count(tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_text('time = "t"\n[theta]\nmessage = "M"\nsignal = "a"\n[z_ddot]\nsignal = "z"\n')
    file = str(tmp_path / "m.toml")
    both = read_mapping([file, "theta=b", "time=s,unit=ms"])
    assert (both.sources["theta"].signal, both.time, both.time_unit) == ("b", "s", "ms")
    both = read_mapping(["theta=b", "time=s,unit=ms", file])
    assert (both.sources["theta"].signal, both.time, both.time_unit) == ("M.a", "t", "")
    assert time_column("my time,unit=us") == ("my time", "us")
    assert time_column("t, s") == ("t, s", "")


# --- units and names -------------------------------------------------------------------------------------------------

INCH, FOOT, POUND, G = 0.0254, 0.3048, 4.4482216152605, 9.80665
FACTORS: dict[str, dict[str, float]] = {
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0},
    "theta": {
        "rad": 1.0, "mrad": 1e-3, "urad": 1e-6, "deg": math.pi / 180.0, "gon": math.pi / 200.0, "rev": 2.0 * math.pi
    },
    "theta_dot": {
        "rad/s": 1.0, "mrad/s": 1e-3, "deg/s": math.pi / 180.0, "rpm": math.pi / 30.0, "deg/min": math.pi / 10800.0,
        "rev/s": 2.0 * math.pi, "gon/s": math.pi / 200.0,
    },
    "z_ddot": {
        "m/s2": 1.0, "mm/s2": 1e-3, "cm/s2": 1e-2, "ft/s2": FOOT, "in/s2": INCH, "g": G, "g0": G, "mg": 1e-3 * G,
        "ug": 1e-6 * G,
    },
    "tau_m": {
        "N m": 1.0, "mN m": 1e-3, "N cm": 1e-2, "kN m": 1e3, "lbf ft": POUND * FOOT, "lbf in": POUND * INCH,
        "ft lbf": POUND * FOOT, "in lbf": POUND * INCH,
    },
    "grip_force": {"N": 1.0, "mN": 1e-3, "daN": 10.0, "kN": 1e3, "lbf": POUND, "kgf": G},
}  # fmt: skip


@pytest.mark.parametrize("key", FACTORS)
def test_factors_to_si(key: str) -> None:
    assert {unit: factor(key, unit) for unit in FACTORS[key]} == pytest.approx(FACTORS[key])
    for unit in FACTORS[key]:
        assert is_unit(unit)
        assert (key in fitting(unit)) is (key in INPUTS)
    assert factor(key, "furlong") is None


def test_other_words_are_no_units() -> None:
    assert not any(map(is_unit, ("furlong", "", "volt", "%")))
    assert fitting("g") == {"z_ddot"}
    assert set(KINDS) - set(INPUTS) == {"time"}


@pytest.mark.parametrize(
    ("label", "expected"),
    [
        ("Angle [deg]", ("Angle", "deg")), ("Angle(deg)", ("Angle", "deg")), (" Angle {deg} ", ("Angle", "deg")),
        ("Angle []", ("Angle", "")), ("angle_deg", ("angle_deg", "deg")), ("rate deg/s", ("rate deg/s", "deg/s")),
        ("rate_deg_s", ("rate_deg_s", "deg/s")), ("acc_m_s2", ("acc_m_s2", "m/s2")),
        ("torque_N_m", ("torque_N_m", "N m")),
        ("acc_g", ("acc_g", "g")), ("t_s", ("t_s", "s")), ("force_N", ("force_N", "N")), ("acc_h", ("acc_h", "")),
        ("plain", ("plain", "")), ("deg", ("deg", "")),
    ],
)  # fmt: skip
def test_the_unit_in_a_label(label: str, expected: tuple[str, str]) -> None:
    name, unit = split_name(label)
    assert (name, unit.replace("N/m", "N m")) == expected


@pytest.mark.parametrize(
    ("size", "unit", "why"),
    [(2.0, "m/s^2", "2 g would be more than a cabin shakes"), (0.5, "g", "0.5 m/s^2 would be less than anything can")],
)
def test_the_likely_unit_of_an_acceleration_without_gravity(size: float, unit: str, why: str) -> None:
    found, because = likely("z_ddot", size * np.sin(np.linspace(0.0, 100.0, 5000)))
    assert found == unit
    assert because.startswith(why)
    assert likely("theta", np.array([1.0]))[0] == "rad"


# --- times -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "name", ["time", "Time", "timestamp", "timestamps", "t", "Zeit", "temps", "epoch", "utc", "time_s", "time ms",
             "t_us",              "time_rel", "timestamp_ns", "Time_Abs", "time_stamp", "time_sec", "t seconds"],
)  # fmt: skip
def test_names_of_time(name: str) -> None:
    columns = {"a": (np.zeros(3), ""), name: (np.arange(3.0), "")}
    assert find_time(columns, "file") == name


@pytest.mark.parametrize("name", ["timer", "theta", "time_x", "runtime", "tx"])
def test_names_that_are_no_time(name: str) -> None:
    with pytest.raises(LeverError) as error:
        find_time({name: (np.zeros(3), ""), "b": (np.zeros(3), "")}, "file")
    assert str(error.value) == (
        "file: no column of time that is known by its name: say which by --map time=COLUMN "
        f"(`lever map`: --time COLUMN); it has {name}, b"
    )


def test_a_time_that_is_named_and_one_of_dates() -> None:
    dates = np.array(["2024-05-01T00:00:00", "2024-05-01T00:00:01.5"], "datetime64[ns]")
    columns = {"when": (dates, ""), "my t [ms]": (np.arange(2.0), "ms")}
    assert find_time(columns, "file") == "when"
    assert find_time(columns, "file", "my t") == "my t [ms]"
    assert np.diff(seconds(dates, "", "x")) == pytest.approx([1.5])
    assert np.diff(seconds(dates - dates[0], "", "x")) == pytest.approx([1.5])
    with pytest.raises(LeverError, match=r"file: no column other: .* it has when, my t \[ms\]"):
        find_time(columns, "file", "other")
    many = {f"c{k}": (np.zeros(2), "") for k in range(14)}
    with pytest.raises(LeverError, match=r"it has c0, c1, .*, c11 and 2 more$"):
        find_time(many, "file")
    with pytest.raises(LeverError, match=r"it has no columns$"):
        find_time({}, "file")


@pytest.mark.parametrize(
    ("step", "scale"),
    [(0.02, 1.0), (0.089, 1.0), (0.091, 1e-3), (20.0, 1e-3), (91.0, 1e-6), (20e3, 1e-6), (91e3, 1e-9), (1e6, 1e-9)],
)
def test_the_unit_of_time_by_its_steps(step: float, scale: float) -> None:
    values = step * np.arange(9.0)
    values[4:] -= 3.0 * step  # set back
    assert time_scale(values) == scale


@pytest.mark.parametrize(
    ("values", "unit", "said"),
    [
        (np.array(["a"]), "s", "x is no column of numbers or dates"),
        (np.array([0.0, np.nan, np.inf]), "s", "x has 2 rows without a time: remove them"),
        (np.arange(3.0), "furlong", "x is in furlong, which is no unit of time known here: s, ms, us, ns"),
        (np.array([0.0, 2.0, 1.0, 3.0]), "s", "x goes back in 1 of 4 rows: sort by time"),
    ],
)
def test_what_is_no_time(values: Any, unit: str, said: str) -> None:
    with pytest.raises(LeverError) as error:
        seconds(values, unit, "x")
    assert str(error.value) == said
    assert seconds(np.array([*range(9), 8.5, 9.0]), "ms", "x")[-1] == pytest.approx(0.009)  # a tenth may go back


def test_a_clock_that_goes_back_goes_on() -> None:
    clock = RunningClock(1.0)
    time = clock.running(np.array([10.0, 11.0, 12.0, 3.0, 4.0, 3.5]))
    assert np.all(np.diff(time[:5]) >= 0.0)
    assert time[4] - time[3] == pytest.approx(1.0)
    assert time[5] - time[4] == pytest.approx(-0.5)  # by less than 1: out of order, and not set back
    (note,) = clock.note()
    assert re.search(r"goes back at 3 s by 9 s", note)
    assert RunningClock(1.0).note() == ()


# --- signals ---------------------------------------------------------------------------------------------------------


def test_a_column_by_its_name_or_a_part_of_it() -> None:
    columns = [Signal(name, np.zeros(1), np.zeros(1)) for name in ("IMU.z", "GPS.z", "lever.Angle", "Rate")]
    assert column(columns, "IMU.z", "f") is columns[0]
    assert column(columns, "rate", "f") is columns[3]
    assert column(columns, "Rate [deg/s]", "f") is columns[3]
    assert column(columns, "Angle", "f") is columns[2]
    with pytest.raises(LeverError, match=r"^f: no column z; there are IMU\.z, GPS\.z"):
        column(columns, "z", "f")
    with pytest.raises(LeverError, match=r"^f: no column Rates; there are Rate …$"):
        column(columns, "Rates", "f")


def test_what_comes_no_later_is_left_out() -> None:
    signal = Signal("x", np.array([0.0, 2.0, 1.0, 2.0, 3.0]), np.arange(5.0))
    kept, count = ordered(signal)
    assert (kept.time.tolist(), kept.values.tolist(), count) == ([0.0, 2.0, 3.0], [0.0, 1.0, 4.0], 2)
    assert kept.period == 1.5


def test_each_signal_of_a_table_knows_its_time(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("t [ms],angle [deg],on\n" + "".join(f"{2 * k},{k / 10},1\n" for k in range(20)))
    angle, on = read_table(str(tmp_path / "a.csv"))
    assert (angle.name, angle.unit, angle.time_column, angle.time_unit, angle.notes) == (
        "angle",
        "deg",
        "t",
        "ms",
        (),
    )
    assert angle.time[-1] == pytest.approx(0.038)
    assert angle.period == pytest.approx(2e-3)
    assert (on.name, on.unit, on.changes(), angle.changes()) == ("on", "", False, True)
    part = angle.between(0.010, 0.020)
    assert (part.time[0], part.time[-1], len(part.time)) == (pytest.approx(0.010), pytest.approx(0.018), 5)


# --- options of commands ---------------------------------------------------------------------------------------------


def parsed(*arguments: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    options.add_setting_options(parser)
    options.add_signal_options(parser)
    options.add_aircraft_option(parser)
    for name in ("--channel", "--id-offset", "--id-base"):
        parser.add_argument(name)
    return parser.parse_args(arguments)


def test_each_option_is_handed_on_to_the_next_command() -> None:
    given = ("--dbc", "a.dbc", "--channel", "can1", "--clock", "z_ddot", "--id-offset", "64", "--id-base", "1")
    args = parsed(*given, "--map", "theta=a", "z_ddot=b")
    assert options.reading_words(args, ["x.log"], args.map) == ["x.log", *given, "--map", "theta=a", "z_ddot=b"]
    assert options.reading_words(parsed(), ["x.log", "y.log"], []) == ["x.log", "y.log"]
    assert options.option_words({"--a": 1, "--b": None, "--c": "x y"}) == ["--a", "1", "--c", "x y"]


def test_files_that_options_name_are_inputs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("my.csv").write_text("")
    args = parsed(
        "--settings", "s", "--dbc", "d", "--aircraft", "my.csv,gearing=2", "--map", "theta=a", "M.TOML", "b.toml"
    )
    assert options.input_files(args) == ["s", "d", "my.csv", "M.TOML", "b.toml"]
    assert options.input_files(parsed("--aircraft", "bell206")) == []


def test_choices_and_settings_take_precedence_in_order(tmp_path: Path) -> None:
    file = tmp_path / "my.settings"
    file.write_text("theta_noise = 0.002\ntheta_dot_noise = 0.03\nmodel = hand\n")
    args = parsed("--settings", str(file), "--set", "theta_noise=0.003", "--set", "theta_noise=0.004")
    assert options.chosen_assignments(args) == {"theta_noise": 0.004, "theta_dot_noise": 0.03, "model": "hand"}
    args.model = "lever"
    assert options.chosen_assignments(args)["model"] == "lever"
    assert options.chosen_assignments(parsed()) == {}


def test_the_part_of_a_log() -> None:
    assert options.check_part(parsed()) == (0.0, math.inf)
    assert options.check_part(parsed("--start", "2", "--length", "0.5")) == (2.0, 0.5)
    for wrong in (("--start", "-1"), ("--length", "0"), ("--start", "nan"), ("--length", "nan")):
        with pytest.raises(LeverError, match="seconds, and length must be more than 0"):
            options.check_part(parsed(*wrong))


def test_how_a_log_is_read(tmp_path: Path) -> None:
    reading = options.chosen_reading(parsed("--channel", "can1", "--start", "3"), "x.log")
    assert (reading.is_of_lever_dbc, reading.channel, reading.start, reading.length) == (True, "can1", 3.0, math.inf)
    assert reading.mapping is None
    args = parsed("--dbc", "a.dbc", "--map", *ANY, "--clock", "theta", "--length", "4", "--channel", "b")
    reading = options.chosen_reading(args, "x.log")
    assert (reading.is_of_lever_dbc, reading.database, reading.clock, reading.length) == (False, "a.dbc", "theta", 4.0)
    assert (reading.channel, reading.mapping) == ("b", read_mapping(ANY))
    with pytest.raises(LeverError, match="--clock goes with --map"):
        options.chosen_reading(parsed("--clock", "theta"), "x.log")
    table = options.chosen_reading(parsed(), str(tmp_path / "x.parquet"))
    assert (table.is_of_lever_dbc, table.mapping) == (False, None)


@pytest.mark.parametrize(("back", "note"), [(0.9, False), (1.2, True)])
def test_a_clock_of_a_table_is_set_back_by_more_than_a_second(back: float, note: bool, tmp_path: Path) -> None:
    times = [*np.arange(0.0, 3.0, 0.01), *(np.arange(3.0, 6.0, 0.01) - back)]
    (tmp_path / "a.csv").write_text("t [s],a\n" + "".join(f"{at:.2f},{k % 7}\n" for k, at in enumerate(times)))
    (found,) = read_table(str(tmp_path / "a.csv"))
    assert bool(found.notes) is note


@pytest.mark.parametrize(("size", "unit"), [(0.69, "g"), (0.72, "m/s^2")])
def test_the_likely_unit_changes_at_what_a_cabin_shakes(size: float, unit: str) -> None:
    assert likely("z_ddot", size * np.where(np.arange(1000) % 2, 1.0, -1.0))[0] == unit
