"""`lever map`: which signals of ten databases with other names and units are proposed, among many others."""

from __future__ import annotations

import json
import shlex
from pathlib import Path

import cantools.database
import numpy as np
import pytest
from cantools.database.can import Database
from lever_cdkf.cli.main import main
from lever_cdkf.runtime.provenance import provenance
from lever_cdkf.signals import plots, proposal
from lever_cdkf.signals.bus_signals import load_database
from lever_cdkf.signals.recorded import Signal
from python.conftest import Refused
from python.report.reading import figures, read, unpack
from python.signals.databases import AIRCRAFT, WITH_TORQUE, WITHHELD, Aircraft, database
from python.signals.flight import NATURAL_FREQUENCY, Flight
from python.signals.test_mapped_replay import frequency, replayed


def recorded(aircraft: Aircraft, seed: int, flight: Flight, folder: Path) -> tuple[Path, Path, dict[str, str]]:
    """Log, database, and the truth."""
    text, fields, truth = database(aircraft, seed, flight)
    loaded = cantools.database.load_string(text, strict=False)
    assert isinstance(loaded, Database)
    frames = []
    for number, message in enumerate(loaded.messages):
        columns = {field.name: field.values.tolist() for field in fields if field.message == message.name}
        for time, *row in zip(flight.time.tolist(), *columns.values(), strict=True):
            data = message.encode(dict(zip(columns, row, strict=True)), strict=False)
            stamp = time + 1e-5 * number
            frames.append((stamp, f"({stamp:.6f}) can0 {message.frame_id:03X}#{data.hex().upper()}\n"))
    (folder / "foreign.dbc").write_text(text)
    (folder / "flight.log").write_text("".join(line for _, line in sorted(frames)))
    return folder / "flight.log", folder / "foreign.dbc", truth


@pytest.fixture(scope="module")
def short(flight: Flight) -> Flight:
    """Seven seconds at 100 Hz."""
    slow = flight.every(5)
    return Flight(*(values[:700] for values in (slow.time, slow.theta, slow.theta_dot, slow.z_ddot)))


@pytest.mark.parametrize(("low", "high", "together"), [(2.0, 8.0, True), (10.0, 20.0, False)])
def test_what_moves_with_the_base_does_so_where_a_lever_can(low: float, high: float, together: bool) -> None:
    """Two signals of noise that are the same in one band: from 2 to 8 Hz it counts, and what motors do above not."""
    time, random = 0.01 * np.arange(6000.0), np.random.default_rng(1)
    frequency = np.fft.rfftfreq(len(time), 0.01)
    in_band = (frequency > low) & (frequency < high)
    spectra = np.fft.rfft(random.standard_normal((3, len(time))))
    base, lever = (np.fft.irfft(np.where(in_band, spectra[2], own)) for own in spectra[:2])
    signals = [Signal("LeverAngle", time, 20.0 + lever, "deg"), Signal("AccVert", time, 1.0 + 0.1 * base, "g")]
    _, proposed, _ = proposal.propose(signals, "a test")
    why = next(each.why for each in proposed if each.key == "theta")
    assert any(words.startswith("moves with AccVert") for words in why) == together


@pytest.mark.parametrize("fleet", [AIRCRAFT, WITH_TORQUE, WITHHELD], ids=["no torque", "torque", "withheld"])
def test_at_least_eight_of_ten_are_right(fleet: list[Aircraft], short: Flight, tmp_path: Path) -> None:
    wrong = {}
    for index, aircraft in enumerate(fleet):
        folder = tmp_path / str(index)
        folder.mkdir()
        log, dbc, truth = recorded(aircraft, 100 + index, short, folder)
        found = {}
        if main(["map", str(log), "--dbc", str(dbc), "--json", str(folder / "map.json")]) == 0:
            rows = json.loads((folder / "map.json").read_text())["mapping"]
            found = {row["input"]: row["signal"] for row in rows}
        if found != truth:
            wrong[index] = (truth, found)
    assert len(wrong) <= 2, wrong


def test_the_proposal_can_be_used_as_it_is(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log, dbc = folder / "flight.log", folder / "foreign.dbc"
    page, toml = tmp_path / "signals.html", tmp_path / "my.toml"
    assert main(["map", str(log), "--dbc", str(dbc), "--toml", str(toml), "-o", str(page)]) == 0
    said = capsys.readouterr().out
    assert "--map theta=InceptorPosition.LvrAngle theta_dot=InceptorPosition.LvrRate z_ddot=AhrsAccel.AccVert" in said
    shown = figures(read(page))
    notes = {key: [note["text"] for note in spec["layout"]["annotations"]] for key, spec in shown.items()}
    assert [text.split(":")[0] for text in notes["figure-inputs"]] == ["theta", "theta_dot", "z_ddot"]
    assert len(shown["figure-others"]["data"]) == len(notes["figure-others"]) == 1
    assert "5 other signals never change" in said  # foreign.dbc has nine
    assert "▁" in said
    commands = [shlex.split(line) for line in said.splitlines() if line.startswith(("lever tune ", "lever replay "))]
    assert [words[2:5] for words in commands] == [[str(log), "--dbc", str(dbc)]] * 2
    assert f"Written: {toml}, {page}" in " ".join(said.split())
    summary = replayed(tmp_path / "out", log, "--dbc", dbc, "--map", toml)
    assert frequency(summary) == pytest.approx(NATURAL_FREQUENCY, rel=0.02)


def test_columns_and_a_picture(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    picture = tmp_path / "signals.png"
    assert main(["map", str(folder / "columns.csv"), "-o", str(picture)]) == 0
    assert "--map 'theta=Lever angle' 'theta_dot=Lever rate' 'z_ddot=Vertical acc.'" in capsys.readouterr().out
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("unit", ["m/s^2", "g"])
@pytest.mark.parametrize("rate", ["rad/s", "deg/s"])
def test_what_has_no_unit_is_proposed_with_one(
    rate: str, unit: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """An acceleration by its size, a rate by the slope of the angle; and the command that is proposed is taken."""
    time = np.arange(0.0, 30.0, 0.002)
    random = np.random.default_rng(1)
    waves = [(random.uniform(1.0, 8.0), random.uniform(0.0, 6.0)) for _ in range(20)]
    base = np.sum([0.3 * np.sin(2.0 * np.pi * hertz * time + phase) for hertz, phase in waves], axis=0)
    theta, theta_dot = np.zeros_like(time), np.zeros_like(time)
    for k in range(1, len(time)):
        theta_dot[k] = theta_dot[k - 1] - 0.002 * (2.1 * base[k] + 13.0 * theta_dot[k - 1] + 500.0 * theta[k - 1])
        theta[k] = theta[k - 1] + 0.002 * theta_dot[k]
    columns = {
        "time": time,
        "lever_angle": 0.3 + theta,
        "lever_rate": theta_dot * (1.0 if rate == "rad/s" else 180.0 / np.pi),
        "floor_acc": base / (1.0 if unit == "m/s^2" else 9.80665),
        "Motormoment": 0.3 * np.sin(20.0 * time),
    }
    log = tmp_path / "flight.csv"
    rows = (",".join(f"{value:.6f}" for value in row) for row in zip(*columns.values(), strict=True))
    log.write_text("\n".join([",".join(columns), *rows]))
    assert main(["map", str(log)]) == 0
    said = capsys.readouterr().out
    assert f"z_ddot = floor_acc has no unit: {unit} is assumed (" in said
    assert f"theta_dot = lever_rate has no unit: {rate} is assumed (" in said
    assert "theta = lever_angle has no unit: rad is assumed (" in said
    assert "tau_m is not mapped: Motormoment has no unit" in said
    (command,) = (line for line in said.splitlines() if line.startswith("lever replay"))
    assert main(shlex.split(command)[1:]) == 0
    assert "one of them is in another unit" not in capsys.readouterr().out


def test_a_signal_that_begins_later_is_drawn_later_and_a_gap_as_a_gap(tmp_path: Path) -> None:
    """Short signals value by value; long ones as the least and the greatest of each stretch, none across a gap."""
    values = np.arange(100.0)
    time = np.concatenate((np.linspace(5.0, 15.0, 10_000), np.linspace(65.0, 75.0, 10_000)))
    signals = [
        ("theta", Signal("early", 5.0 + values, values, "<rad>")),
        ("theta_dot", Signal("late", 45.0 + values, values)),
        ("", Signal("long", time, np.sin(40.0 * time))),
        ("", Signal("empty", time[:0], time[:0])),
    ]
    plots.write(tmp_path / "page.html", signals, "title", provenance())
    shown = figures(read(tmp_path / "page.html"))
    early, late = ({axis: unpack(trace[axis]) for axis in "xy"} for trace in shown["figure-inputs"]["data"])
    assert (early["x"][0], late["x"][0], early["x"][-1], late["x"][-1]) == (0.0, 40.0, 99.0, 139.0)
    assert early["y"].tolist() == values.tolist()
    assert shown["figure-inputs"]["layout"]["annotations"][0]["text"] == "theta: early, 0 to 99 &lt;rad&gt;"
    assert [spec["layout"]["xaxis"]["range"] for spec in shown.values()] == [[0.0, 139.0]] * 2
    trace, empty = shown["figure-others"]["data"]
    assert len(unpack(empty["x"])) == 0
    x, y = unpack(trace["x"]), unpack(trace["y"])
    assert len(x) < 1300
    (gap,) = np.flatnonzero(np.isnan(y))
    assert x[gap - 1] == pytest.approx(10.0, abs=0.05)
    assert x[gap + 1] == pytest.approx(60.0, abs=0.05)
    assert np.nanmin(y) == pytest.approx(-1.0, abs=1e-3)
    assert np.nanmax(y) == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize(
    ("word", "weight"),
    [("lever", 2.0), ("lvr", 2.0), ("lev", 2.0), ("leverangle", 5.0), ("lx", 0.0), ("levers", 2.0), ("vlr", 0.0)],
)
def test_words_of_names_may_be_shortened_or_compounds(word: str, weight: float) -> None:
    assert proposal._weight({"lever": 2.0, "angle": 3.0}, word) == weight


def test_a_database_in_utf_8_or_not(tmp_path: Path) -> None:
    text = 'BU_: A\nBO_ 5 Lever: 8 A\n SG_ Angle : 0|16@1- (0.01,0) [0|0] "°" A\n'
    for encoding in ("utf-8", "cp1252"):
        (tmp_path / "it.dbc").write_bytes(text.encode(encoding))
        (message,) = load_database(tmp_path / "it.dbc").messages
        assert message.signals[0].unit == "°"


def test_a_database_with_a_flaw_in_a_message_is_read(tmp_path: Path) -> None:
    """Others' are as they are: here one signal is longer than its frame, and two overlap."""
    places = {"One": "8|16", "Two": "0|16"}
    signals = "".join(f' SG_ {name} : {bits}@1- (1,0) [0|0] "" A\n' for name, bits in places.items())
    (tmp_path / "it.dbc").write_text(f"BU_: A\nBO_ 5 Lever: 2 A\n{signals}")
    (message,) = load_database(tmp_path / "it.dbc").messages
    assert {each.name for each in message.signals} == places.keys()


def test_what_cannot_be_proposed(folder: Path, tmp_path: Path, refused: Refused) -> None:
    log = folder / "flight.log"
    assert "add --dbc FILE" in refused("map", log)
    assert "plots are .html, " in refused("map", folder / "columns.csv", "-o", tmp_path / "signals.gif")
    (tmp_path / "other.dbc").write_text('BU_: A\nBO_ 5 Nothing: 8 A\n SG_ Zero : 0|8@1+ (1,0) [0|0] "" A\n')
    assert "is it the database of this bus?" in refused("map", log, "--dbc", tmp_path / "other.dbc")
    (tmp_path / "few.csv").write_text("time,rpm\n" + "".join(f"{k},{k % 7}\n" for k in range(100)))
    assert "map it by hand" in refused("map", tmp_path / "few.csv")
    assert ".html, .png, .svg, .pdf" in refused("map", log, "--dbc", folder / "foreign.dbc", "-o", tmp_path / "x.gif")
