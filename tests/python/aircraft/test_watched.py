"""The margin to collective bounce of a recorded log: in every file of a replay, and in the views of a bus."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import numpy as np
import pyarrow.csv
import pyarrow.parquet
import pytest
from lever_cdkf.can import codec
from lever_cdkf.can.estimator_frames import EstimatorFrames, read_samples
from lever_cdkf.can.logs import Recording
from lever_cdkf.cli.main import main
from lever_cdkf.firmware.aircraft import AircraftResponse, read_response
from lever_cdkf.firmware.native import Config, Estimator
from lever_cdkf.firmware.settings_file import format_config
from lever_cdkf.numeric.arrays import FloatArray
from lever_cdkf.watch import panels, status
from lever_cdkf.watch.picture import Picture
from lever_cdkf.watch.sources import LogSource
from lever_sil.aircraft import aircraft
from lever_sil.aircraft.aircraft import Coupled
from lever_sil.commands.aircraft import response
from lever_sil.scenarios import scenario
from python.aircraft.loops import decibels, loop_of, margins
from python.conftest import Refused, Run, Session
from python.report.reading import figures, read

SAME = ("sim", "replay")
Columns = dict[str, FloatArray]
CHANGED = "uh60_like,gearing=0.5,warning=30"


@cache
def trace_of(folder: Path) -> Columns:
    table = pyarrow.csv.read_csv(folder / "trace.csv")
    return {name: table[name].to_numpy() for name in table.column_names}


@pytest.fixture(scope="module")
def out(session: Session, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("watched") / "out"
    arguments = ["--aircraft", CHANGED, "--format", "csv,mf4,mcap,parquet", "-o", str(folder)]
    assert main(["replay", str(session.log), *arguments]) == 0
    return folder


def test_the_margin_is_that_of_the_estimator_with_the_same_samples(session: Session, out: Path) -> None:
    """But for its steps on the bus."""
    estimator = Estimator(Config())
    estimator.watch(response("uh60_like", ["gearing=0.5", "warning=30"]))
    samples = read_samples(EstimatorFrames(Recording([session.log])))
    for row in zip(*(samples[name] for name in ("time_us", "theta", "theta_dot", "tau_m", "z_ddot")), strict=True):
        time_us, *values = (float(value) for value in row)
        estimator.update(int(time_us), *(None if np.isnan(value) else value for value in values))
    expected = estimator.stability()
    trace = trace_of(out)
    for column, value, step in (
        ("gain_margin_dB", expected.gain_margin, 0.02),
        ("gain_margin_sigma_dB", expected.gain_margin_sigma, 0.04),
        ("modulus", expected.modulus, 0.01),
        ("bounce_frequency_Hz", expected.frequency, 0.01),
    ):
        assert trace[column][-1] == pytest.approx(value, abs=step)


def test_every_file_has_it(out: Path) -> None:
    summary = json.loads((out / "summary.json").read_text())
    assert summary["stability"]["warning_db"] == 30.0
    assert summary["stability"]["states_s"]["warning"] > 1.0
    assert "With uh60_like, gearing 0.5, the gain margin to collective bounce was least at" in summary["verdict"]
    assert set(pyarrow.parquet.read_table(out / "trace.parquet")["bounce"].to_pylist()) >= {"warning"}
    assert "figure-stability" in figures(read(out / "report.html"))
    assert main(["replay", str(out / "trace.parquet"), "-o", str(out.parent / "again")]) == 0


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a simulation of a scenario with an aircraft, and the replay of its log with the same."""
    folder = tmp_path_factory.mktemp("flown")
    cancelled = ("estimator.mitigation='cancellation'", "duration=6 s", "pilot.c_p=30 N s/m", "limits={}")
    overrides = [part for each in cancelled for part in ("--set", each)]
    assert main(["sim", "bounce", *overrides, "-o", str(folder / "sim")]) == 0
    watched = ["--aircraft", "uh60_like,gearing=0.5"]
    settings = folder / "flown.settings"
    settings.write_text(format_config(scenario.load("bounce", list(cancelled)).config))
    log = str(folder / "sim" / "bus.log")
    assert main(["replay", log, *watched, "--settings", str(settings), "-o", str(folder / "replay")]) == 0
    return folder


def test_a_loop_that_is_unstable_is_told(lever: Run) -> None:
    overrides = ("duration=2 s", "aircraft.gearing=5 1", "limits={}")
    said = lever("sim", "bounce", *(part for each in overrides for part in ("--set", each)))[1]
    assert "In truth the loop was unstable for 2 s, by up to 1" in said


@pytest.mark.parametrize(
    "change", ["base.0.rms=1e300 g", "disturbance=[{kind='sine',rms='1e30 N m',frequency='3 Hz'}]"]
)
def test_a_run_beyond_all_bounds_is_one_line(change: str, refused: Refused) -> None:
    said = refused("sim", "bounce", "--set", change, "--set", "duration=2 s")
    assert "grows beyond all bounds" in said


def test_a_simulation_has_what_a_replay_of_its_log_has(flown: Path) -> None:
    of_sim, of_replay = (trace_of(flown / each) for each in SAME)
    for column in ("bounce", "gain_margin_dB", "gain_margin_sigma_dB", "modulus", "correction_rad"):
        assert np.array_equal(of_sim[column], of_replay[column], equal_nan=True)
    assert np.count_nonzero(np.nan_to_num(of_sim["correction_rad"])) > 3000
    of_sim, of_replay = (json.loads((flown / each / "summary.json").read_text())["stability"] for each in SAME)
    truth = {"least_true_margin_db": None, "unstable_s": None}
    assert of_sim | truth == of_replay
    assert of_sim["least_true_margin_db"] == pytest.approx(np.nanmin(trace_of(flown / "sim")["gain_margin_true_dB"]))
    assert of_sim["unstable_s"] == 0.0
    assert of_sim["greatest_correction_rad"] > 1e-3
    assert "figure-stability" in figures(read(flown / "sim" / "report.html"))


def test_a_simulation_knows_the_true_margin(flown: Path) -> None:
    trace = trace_of(flown / "sim")
    coupled = Coupled(aircraft.load("uh60_like"), 0.5)
    truth = scenario.load("bounce", ["pilot.c_p=30 N s/m"]).truth(np.zeros(1))
    expected = decibels(margins(loop_of(coupled, truth.transfer(np.array([0])), 0)).gain)
    assert trace["gain_margin_true_dB"] == pytest.approx(expected, abs=0.02)
    assert trace["gain_margin_dB"][-1] == pytest.approx(expected, abs=3.0 * trace["gain_margin_sigma_dB"][-1])


def test_without_an_aircraft_there_is_none(session: Session, tmp_path: Path) -> None:
    assert main(["replay", str(session.log), "-o", str(tmp_path)]) == 0
    assert json.loads((tmp_path / "summary.json").read_text())["stability"] is None
    assert "bounce" not in (tmp_path / "trace.csv").read_text().partition("\n")[0]


def test_a_view_of_the_bus_shows_it(out: Path) -> None:
    picture, source = Picture(), LogSource(str(out / "bus.log"), None)
    source.read_into(picture)
    level, text = status.condition(picture)
    assert (level, text[:40]) == ("watch", "collective bounce, warning: gain margin ")
    from rich.console import Console

    console = Console(width=100)
    with console.capture() as capture:
        console.print(panels.health(picture, source))
    assert "warning: gain margin" in capture.get()


# --- aircraft as files -----------------------------------------------------------------------------------------------


def test_a_file_holds_the_response(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "uh60.response"
    assert main(["aircraft", "uh60_like", "gearing=0.5", "alarm=1", "-o", str(path)]) == 0
    written, kept = response("uh60_like", ["gearing=0.5", "alarm=1"]).pointer, read_response(str(path)).pointer
    assert written.count == kept.count == 24
    for name in ("frequency", "real", "imaginary"):
        assert list(getattr(kept, name)) == pytest.approx(list(getattr(written, name)), rel=1e-5)
    for name in ("gain_sigma", "phase_sigma", "warning", "alarm"):
        assert getattr(kept, name) == pytest.approx(getattr(written, name))
    assert main(["aircraft", "uh60_like", "gearing=0.5", "alarm=1"]) == 0
    printed = capsys.readouterr().out.splitlines()
    lines = path.read_text().splitlines()
    assert [each for each in printed if each[0] != "#"] == [each for each in lines if each[0] != "#"]
    assert main(["aircraft"]) == 0
    assert "puma_like" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("gain_sigma = 0.1\n1 2 3\n", "It needs a line phase_sigma = number"),
        ("gain_sigma = 0.1\n1 2\n", ":2: neither"),
        ("gain = 0.1\n", ":1: neither"),
        ("gain_sigma = much\n", ":1: neither"),
        ("gain_sigma = 0.1\ngain_sigma = 0.2\n", ":2: neither"),
        ("gain_sigma = 0x1p-3\n", ":1: neither"),
        ("1_0 2 3\n", ":1: neither"),
        ("1 2 3\r2 3 4\r", ":1: neither"),
        ("#" * 511, ":1: the line is longer than 510 bytes"),
        ("gain_sigma = 0.1\nphase_sigma = 0.1\n1 2 3\n", "has 3 to 24 frequencies"),
        ("gain_sigma = 0.1\nphase_sigma = 0.1\n1 2 3\n2 3 4\n2 3 4\n", "frequencies must rise"),
    ],
)
def test_what_is_no_response(content: str, said: str, session: Session, tmp_path: Path, refused: Refused) -> None:
    (tmp_path / "it.response").write_text(content)
    assert said in refused("replay", session.log, "--aircraft", tmp_path / "it.response")


def test_what_is_no_aircraft(session: Session, refused: Refused) -> None:
    assert "no aircraft 'uh61'" in refused("replay", session.log, "--aircraft", "uh61")
    assert "gain_sigma: 'x' is not a quantity" in refused("replay", session.log, "--aircraft", "uh60_like,gain_sigma=x")


def test_a_path_is_told_from_a_name(session: Session, tmp_path: Path, refused: Refused) -> None:
    own = tmp_path / "own.response"
    for missing in (own, tmp_path):
        assert f"{missing}: cannot be read" in refused("replay", session.log, "--aircraft", missing)
    own.write_text("")
    assert "change it in the file" in refused("replay", session.log, "--aircraft", f"{own},gearing=0.4")
    (tmp_path / "own.csv").write_text("1,2,3\n2,3,4\n3,4,5\n")
    assert "needs it from 2 to 7 Hz" in refused("replay", session.log, "--aircraft", tmp_path / "own.csv")


@pytest.mark.parametrize(
    "change",
    "gain_sigma=-1 gain_sigma=nan phase_sigma=3 alarm=9 gearing=1e39 blades=4.5 blades".split(),  # noqa: SIM905
)
def test_what_nothing_would_read_is_not_written(change: str, tmp_path: Path, refused: Refused) -> None:
    said = refused("aircraft", "uh60_like", change, "-o", tmp_path / "it")
    assert change.partition("=")[0] in said or "sigmas lie between 0 and 1" in said
    assert "mass: '7.4 kg' is out of range" in refused("aircraft", "uh60_like", "mass=7.4 kg", "-o", tmp_path / "it")
    assert "given twice" in refused("aircraft", "uh60_like", "mass=7 kg", "mass=8 kg", "-o", tmp_path / "it")
    assert not (tmp_path / "it").exists()


def test_a_response_is_not_written_over(tmp_path: Path, refused: Refused) -> None:
    own = tmp_path / "own.csv"
    own.write_text(text := "1,31,-26\n3,31,-25\n8,31,-24\n")
    for option in ("-o", "--export"):
        assert f"cannot write {own}: it is an input" in refused("aircraft", own, option, own)
        assert "AIRCRAFT is missing" in refused("aircraft", option, tmp_path / "it.csv")
    assert (own.read_text(), list(tmp_path.iterdir())) == (text, [own])


def test_a_state_space_is_a_file_of_one(tmp_path: Path, refused: Refused) -> None:
    for name in ("uh60_like", tmp_path):
        assert f"--state-space {name}: must end in .mat or .npz or .csv" in refused("aircraft", "--state-space", name)
    assert f"{tmp_path} is a folder: give the .toml file of one aircraft" in refused("aircraft", tmp_path)


def test_values_are_written_as_in_a_scenario() -> None:
    plain = response("uh60_like", ["gearing=0.4", "gain_sigma=0.1", "phase_sigma=0.1", "rotor_speed=27.0 rad/s"])
    with_units = ["gearing=40 %", "gain_sigma=10 %", "phase_sigma=100 mrad", "rotor_speed=257.8310078 rpm", "blades=4"]
    for changes in (with_units, ["gearing=0.4 1", "gain_sigma=0.1 1", "phase_sigma=0.1 rad", "alarm=3.5 dB"]):
        same = response("uh60_like", changes).pointer
        for name in ("real", "imaginary"):
            assert list(getattr(same, name)) == pytest.approx(list(getattr(plain.pointer, name)))
        assert same.gain_sigma == pytest.approx(0.1)
        assert same.phase_sigma == pytest.approx(0.1)


@pytest.mark.parametrize("arguments", [("aircraft",), ("campaign",), ("sim",), ("replay", "--map")])
def test_a_file_that_is_nested_too_deeply_is_one_line(
    arguments: tuple[str, ...], session: Session, tmp_path: Path, refused: Refused
) -> None:
    path = tmp_path / "deep.toml"
    for content in ("a = " + "[" * 100_000, "z_ddot" + ".a" * 3000 + " = 1"):
        path.write_text(content)
        said = refused(arguments[0], *([session.log] if "replay" in arguments else []), *arguments[1:], path)
        assert "deep.toml: its tables or lists are nested too deeply" in said


def test_the_contract_has_a_word_for_each_state() -> None:
    choices = codec.message("STABILITY").get_signal_by_name("bounce").choices
    assert choices is not None
    assert [str(word) for word in choices.values()] == ["unknown", "clear", "warning", "alarm"]
    assert AircraftResponse([1.0, 2.0, 3.0], [1j] * 3, gain_sigma=0.0, phase_sigma=0.0).warning == 5.0
