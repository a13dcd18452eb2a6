"""A log with foreign identifiers, names and units, 500 Hz and other traffic: mapped in one command, in any format."""

from __future__ import annotations

import itertools
import json
import re
import shlex
from pathlib import Path
from typing import Any

import can
import numpy as np
import pytest
import readmes
from lever_cdkf.can import codec
from lever_cdkf.cli.main import main
from lever_cdkf.firmware.native import Config, enum_names, enum_words, run_samples
from lever_cdkf.text.units import GRAVITY
from python.conftest import Refused
from python.signals.flight import MAPPED, NATURAL_FREQUENCY, Flight, as_decoded, write_log

COLUMNS = ("theta=Lever angle", "theta_dot=Lever rate", "z_ddot=Vertical acc.")


def replayed(out: Path, log: Path, *arguments: str | Path) -> dict[str, Any]:
    """`lever replay log … -o out`, which must do; returns its summary."""
    assert main(["replay", str(log), *map(str, arguments), "-o", str(out)]) == 0
    summary: dict[str, Any] = json.loads((out / "summary.json").read_text())
    return summary


def frequency(summary: dict[str, Any]) -> float:
    return float(summary["estimates"]["natural_frequency"]["last"])


def fed_directly(flight: Flight, period: float = 2e-3) -> float:
    """Return the last frequency that the firmware finds in the same values, without any log."""
    samples = {"theta": flight.theta, "theta_dot": flight.theta_dot, "z_ddot": flight.z_ddot}
    time_us = np.rint(flight.time * 1e6).astype(np.int64)
    estimated = run_samples(Config(settings={"sample_period": period}), {"time_us": time_us, **samples})
    return float(estimated["natural_frequency"][-1])


@pytest.mark.parametrize("suffix", ["blf", "asc", "mf4", "csv", "trc", "log"])
def test_every_log_of_the_bus(suffix: str, folder: Path, part: Flight, tmp_path: Path) -> None:
    summary = replayed(tmp_path, folder / f"part.{suffix}", "--dbc", folder / "foreign.dbc", "--map", *MAPPED)
    assert frequency(summary) == pytest.approx(NATURAL_FREQUENCY, rel=0.02)
    assert frequency(summary) == pytest.approx(fed_directly(as_decoded(part)), rel=1e-3)
    assert summary["samples"] == len(part.time)
    mapping = summary["recording"]["mapping"]
    assert mapping["sample_period_s"] == summary["estimator"]["settings"]["sample_period"] == 2e-3
    assert mapping["inputs"]["z_ddot"]["gravity"] == "included"
    assert mapping["unprotected_frames"] == 2 * len(part.time)
    assert summary["recording"]["frames_left_out"] == {"other_identifiers": round(1.2 * len(part.time))}


def test_a_blf_that_is_cut_off_says_so(folder: Path, tmp_path: Path) -> None:
    """Its header holds the length that it had; python-can reads what is left without a word."""
    whole = (folder / "part.blf").read_bytes()
    log = tmp_path / "cut.blf"
    log.write_bytes(whole[: len(whole) // 2])
    summary = replayed(tmp_path / "out", log, "--dbc", folder / "foreign.dbc", "--map", *MAPPED)
    assert f"The log is incomplete: {log.name}: {len(whole) // 2:,} bytes of the {len(whole):,}" in summary["verdict"]
    whole_summary = replayed(tmp_path / "whole", folder / "part.blf", "--dbc", folder / "foreign.dbc", "--map", *MAPPED)
    assert "incomplete" not in whole_summary["verdict"]


def test_a_bus_whose_recorder_was_set_back_loses_nothing(folder: Path, flight: Flight, tmp_path: Path) -> None:
    lines = (folder / "flight.log").read_text().splitlines()
    stamps = [float(line[1 : line.index(")")]) for line in lines]
    half = len(lines) // 2
    moved = [stamp + (3600.0 if index < half else 0.0) for index, stamp in enumerate(stamps)]
    log = tmp_path / "set_back.log"
    log.write_text("".join(f"({at:.6f}{line[line.index(')') :]}\n" for at, line in zip(moved, lines, strict=True)))
    summary = replayed(tmp_path / "out", log, "--dbc", folder / "foreign.dbc", "--map", *MAPPED)
    assert summary["samples"] == len(flight.time)
    assert "The recorded time goes back at 9.999 s by 3,600 s" in summary["verdict"]
    assert frequency(summary) == pytest.approx(NATURAL_FREQUENCY, rel=0.02)


def test_columns_of_a_csv(folder: Path, flight: Flight, tmp_path: Path) -> None:
    summary = replayed(tmp_path, folder / "columns.csv", "--map", *COLUMNS)
    assert frequency(summary) == pytest.approx(NATURAL_FREQUENCY, rel=0.02)
    assert frequency(summary) == pytest.approx(fed_directly(flight), rel=1e-3)


@pytest.mark.parametrize("has_grip", [False, True])
def test_a_grip_force_is_fed_where_it_is_mapped(has_grip: bool, flight: Flight, tmp_path: Path) -> None:
    slow = flight.every(5)
    grip = 20.0 * np.sin(25.0 * slow.time)
    np.savez(tmp_path / "log.npz", t=slow.time, theta=slow.theta, z=slow.z_ddot, grip=grip)
    mapped = ["theta=theta,unit=rad", "z_ddot=z,unit=m/s^2", *(["grip_force=grip,unit=N"] if has_grip else [])]
    replayed(tmp_path / "out", tmp_path / "log.npz", "--map", *mapped)
    identifier = codec.message("GRIP_SAMPLE").frame_id
    frames = [message for message in can.LogReader(tmp_path / "out/bus.log") if message.arbitration_id == identifier]
    fed = [codec.decode(identifier, message.data)[1]["grip_force"] for message in frames]
    assert fed == pytest.approx(grip if has_grip else [], abs=0.05)


def test_what_the_estimator_warns_of_is_said(flight: Flight, tmp_path: Path) -> None:
    """In the verdict and in the shares: a base that is stuck, and an angle that is; not that the log has no torque."""

    def said(name: str, theta: np.ndarray, z_ddot: np.ndarray) -> tuple[str, dict[str, float], float]:
        columns: dict[str, Any] = {
            "time_s": flight.time,
            "theta_rad": theta,
            "theta_dot_rad_s": flight.theta_dot,
            "z_ddot_m_s2": z_ddot,
        }
        np.savez(tmp_path / f"{name}.npz", **columns)
        keys = [
            f"{key}={column}" for key, column in zip(("theta", "theta_dot", "z_ddot"), list(columns)[1:], strict=True)
        ]
        summary = replayed(tmp_path / name, tmp_path / f"{name}.npz", "--map", "time=time_s", *keys)
        return summary["verdict"], summary["fault_shares"], summary["flagged_share"]

    verdict, shares, flagged = said("sound", flight.theta, flight.z_ddot)
    assert not {"theta", "base", "torque", "mismatch"} & shares.keys()
    assert flagged == shares.get("calibration", 0.0) < 0.3
    moving = flight.time < 1.0
    verdict, shares, flagged = said("stuck", flight.theta, np.where(moving, flight.z_ddot, flight.z_ddot[499]))
    assert shares["base"] > 0.9
    assert flagged > 0.9
    assert verdict.startswith(f"Do not trust the estimates: {enum_words('lever_fault')['base']} (")
    assert "Next: check sign, unit and gravity of z_ddot." in verdict
    verdict, shares, flagged = said("frozen", np.where(moving, flight.theta, flight.theta[0]), flight.z_ddot)
    assert shares["theta"] > 0.9


def test_the_same_as_a_log_of_lever_dbc_to_the_bit(folder: Path, tmp_path: Path) -> None:
    """What the mapping feeds is in bus.log; replayed as it is, it gives the same trace, but for one fault: that there
    is no torque is none where the mapping says so."""
    arguments = ("--dbc", folder / "foreign.dbc", "--map", *MAPPED, "--length", "8")
    replayed(tmp_path / "mapped", folder / "flight.log", *arguments)
    again = [line for line in (tmp_path / "mapped/bus.log").read_text().splitlines() if line.endswith("T")]
    (tmp_path / "own.log").write_text("\n".join(again) + "\n")
    replayed(tmp_path / "own", tmp_path / "own.log", "--set", "sample_period=0.002")
    own, mapped = (
        np.genfromtxt(tmp_path / each / "trace.csv", delimiter=",", names=True) for each in ("own", "mapped")
    )
    torque = next(bit for bit, name in enum_names("lever_fault").items() if name == "torque")
    finite = np.isfinite(own["faults"])
    assert (own["faults"][finite].astype(int) & torque).any()
    np.testing.assert_array_equal(mapped["faults"][finite], own["faults"][finite].astype(int) & ~torque)
    for column in set(own.dtype.names or ()) - {"faults"}:
        np.testing.assert_array_equal(mapped[column], own[column])


def test_angle_and_acceleration_are_enough(folder: Path, tmp_path: Path) -> None:
    summary = replayed(tmp_path, folder / "columns.csv", "--map", *COLUMNS[::2])
    assert frequency(summary) == pytest.approx(NATURAL_FREQUENCY, rel=0.02)


@pytest.mark.parametrize("step", [2, 5, 10])
def test_at_other_rates(step: int, flight: Flight, tmp_path: Path) -> None:
    slow = flight.every(step)
    columns = np.column_stack((slow.time, slow.theta, slow.theta_dot, slow.z_ddot))
    np.savetxt(tmp_path / "slow.csv", columns, "%.7f", ",", header="t,theta,theta_dot,z_ddot", comments="")
    summary = replayed(tmp_path / "out", tmp_path / "slow.csv")
    assert summary["estimator"]["settings"]["sample_period"] == pytest.approx(step * 2e-3)
    assert frequency(summary) == pytest.approx(NATURAL_FREQUENCY, rel=0.02)


def test_a_guessed_unit_of_time_is_said_and_can_be_given(flight: Flight, tmp_path: Path, refused: Refused) -> None:
    """Numbers of samples are taken as ms; the user who knows better says so, in words or in a mapping file."""
    log, mapped = tmp_path / "log.csv", ("theta=theta", "z_ddot=z_ddot")
    numbers = np.arange(len(flight.time))
    columns = np.column_stack((numbers, flight.theta, flight.z_ddot + GRAVITY))
    np.savetxt(log, columns, "%.7f", ",", header="time,theta,z_ddot", comments="")
    summary = replayed(tmp_path / "out", log, "--map", *mapped)
    assert "time has no unit: taken as ms (1000 Hz)." in summary["verdict"]
    assert summary["recording"]["mapping"]["times"] == {"time": "ms"}
    assert "every 1000 ms (1 Hz)" in refused("replay", log, "--map", *mapped, "time=time,unit=s")
    assert "furlong is no unit of time" in refused("replay", log, "--map", *mapped, "time=time,unit=furlong")
    (tmp_path / "time.toml").write_text('[time]\nsignal = "time"\nunit = "ms"\n')
    summary = replayed(tmp_path / "out", log, "--map", *mapped, tmp_path / "time.toml")
    assert "no unit: taken as ms" not in summary["verdict"]


@pytest.mark.parametrize("order", ["reversed", "shuffled"])
def test_rows_that_are_not_in_order_of_time_are_refused(
    order: str, flight: Flight, tmp_path: Path, refused: Refused
) -> None:
    places = np.arange(len(flight.time))[::-1]
    places = np.random.default_rng(1).permutation(places) if order == "shuffled" else places
    log = tmp_path / "log.npz"
    np.savez(log, time_s=flight.time[places], theta=flight.theta[places], z_ddot=flight.z_ddot[places])
    said = refused("replay", log, "--map", "theta=theta,unit=rad", "z_ddot=z_ddot,unit=m/s^2")
    assert re.search(r"time_s goes back in [\d,]+ of 1[\d,]+ rows: sort by time", said)


def test_too_slow_is_refused(flight: Flight, tmp_path: Path, refused: Refused) -> None:
    slow = flight.every(20)
    columns = np.column_stack((slow.time, slow.theta, slow.z_ddot))
    np.savetxt(tmp_path / "slow.csv", columns, "%.7f", ",", header="t,theta,z_ddot", comments="")
    said = refused("replay", tmp_path / "slow.csv", "-o", tmp_path / "out")
    assert "every 40 ms (25 Hz); the firmware takes samples from 50 to 10000 Hz" in said
    assert not list(tmp_path.glob("out/*"))


@pytest.mark.parametrize("wrong", ["theta", "theta_dot"])
def test_degrees_that_are_said_to_be_radians_are_refused(
    wrong: str, flight: Flight, tmp_path: Path, refused: Refused
) -> None:
    """Of a lever that moves little, so that the size of neither tells."""
    values = {name: getattr(flight, name) for name in ("theta", "theta_dot", "z_ddot")}
    values = {name: value - value.mean() for name, value in values.items()}
    values["theta_dot"] *= 0.1
    values["theta"] *= 0.1
    values[wrong] = np.degrees(values[wrong])
    np.savez(tmp_path / "log.npz", t=flight.time, **values)
    units = {"theta": "rad", "theta_dot": "rad/s", "z_ddot": "m/s^2"}
    mapped = [f"{name}={name},unit={unit}" for name, unit in units.items()]
    said = refused("replay", tmp_path / "log.npz", "--map", *mapped)
    assert f"{wrong} looks like degrees: map {wrong} with unit=deg" in said


def test_gravity_in_g_that_is_said_to_be_in_si_is_noted(flight: Flight, tmp_path: Path) -> None:
    np.savez(tmp_path / "log.npz", t=flight.time, theta=flight.theta, z=1.0 + flight.z_ddot / GRAVITY)
    mapped = ("theta=theta,unit=rad", "z_ddot=z,unit=m/s^2")
    summary = replayed(tmp_path / "out", tmp_path / "log.npz", "--map", *mapped)
    assert "it is said to be in m/s^2, but rests at 1.00 m/s², as gravity in g does." in summary["verdict"]


@pytest.mark.parametrize("log", ["columns.csv", "flight.blf", "flight.log"])
def test_a_part_behind_the_end(log: str, folder: Path, refused: Refused) -> None:
    mapped = COLUMNS if log == "columns.csv" else ("--dbc", folder / "foreign.dbc", "--map", *MAPPED)
    arguments = ("--map", *mapped) if log == "columns.csv" else mapped
    assert "there is nothing from 100 s on (--start)" in refused("replay", folder / log, *arguments, "--start", "100")


def test_a_part(folder: Path, tmp_path: Path) -> None:
    arguments = ("--dbc", folder / "foreign.dbc", "--map", *MAPPED, "--start", "5", "--length", "12")
    summary = replayed(tmp_path / "mapped", folder / "flight.blf", *arguments)
    assert summary["samples"] == pytest.approx(6000, abs=1)
    replayed(tmp_path / "all", folder / "flight.log", *arguments[:6])
    own = replayed(tmp_path / "own", tmp_path / "all/bus.log", "--set", "sample_period=0.002", *arguments[6:])
    assert own["samples"] == summary["samples"]
    for part, left_out in ((summary, {"other_identifiers": pytest.approx(1.2 * 6000, abs=2)}), (own, {})):
        assert part["recording"]["frames_left_out"] == left_out  # no frame beside the part
        assert part["recording"]["duration_s"] == pytest.approx(12.0, abs=0.01)


# --- how they are mapped ---------------------------------------------------------------------------------------------


def test_a_mapping_file_with_everything_said(folder: Path, flight: Flight, tmp_path: Path) -> None:
    (tmp_path / "foreign.toml").write_text(
        """
[theta]
message = "InceptorPosition"
signal = "LvrAngle"
factor = 0.017453292519943295
[theta_dot]
signal = "LvrRate"
unit = "°/s"
[z_ddot]
signal = "AhrsAccel.AccVert"
gravity = "included"
sign = 1
delay = "0 ms"
[protected.AhrsAccel]
counter = "AccCounter"
"""
    )
    arguments = ("--dbc", folder / "foreign.dbc", "--map", tmp_path / "foreign.toml")
    summary = replayed(tmp_path / "out", folder / "flight.log", *arguments)
    assert frequency(summary) == pytest.approx(fed_directly(as_decoded(flight)), rel=1e-3)
    assert summary["recording"]["mapping"]["notes"] == []
    assert summary["recording"]["mapping"]["unprotected_frames"] == len(flight.time)


def test_losses_are_counted_by_the_counter_that_the_mapping_names(
    folder: Path, frames: list[can.Message], tmp_path: Path
) -> None:
    accelerations = [frame for frame in frames if frame.arbitration_id == 837]
    gone = {id(frame) for frame in accelerations[100:103]} | {id(accelerations[200])}
    kept = [frame for frame in frames if id(frame) not in gone]
    place = kept.index(accelerations[300])
    write_log(tmp_path / "lossy.log", [*kept[: place + 1], accelerations[300], *kept[place + 1 :]])
    (tmp_path / "m.toml").write_text('[protected.AhrsAccel]\ncounter = "AccCounter"\n')
    arguments = ("--dbc", folder / "foreign.dbc", "--map", tmp_path / "m.toml", *MAPPED)
    summary = replayed(tmp_path / "out", tmp_path / "lossy.log", *arguments)
    counts = summary["recording"]["mapping"]["messages"]["AhrsAccel"]
    assert (counts["lost"], counts["repeated"], counts["corrupt"]) == (4, 1, 0)
    assert summary["recording"]["mapping"]["inputs"]["z_ddot"]["missing"] == 4
    assert "4 lost, 1 repeated" in summary["verdict"]


@pytest.fixture(scope="module")
def fd_frames(frames: list[can.Message]) -> list[can.Message]:
    """Return a third of the frames as CAN FD, with 64 bytes of which the database describes eight."""
    return [
        can.Message(
            *(frame.timestamp, frame.arbitration_id, frame.is_extended_id),
            channel=0,
            is_fd=True,
            data=bytes(frame.data).ljust(64, b"\0"),
        )
        for frame in frames[: len(frames) // 3]
    ]


@pytest.mark.parametrize("suffix", ["blf", "asc", "log"])
def test_can_fd(suffix: str, folder: Path, fd_frames: list[can.Message], flight: Flight, tmp_path: Path) -> None:
    log = write_log(tmp_path / f"fd.{suffix}", fd_frames)
    summary = replayed(tmp_path / "out", log, "--dbc", folder / "foreign.dbc", "--map", *MAPPED)
    assert summary["samples"] == len(flight.time) // 3
    assert frequency(summary) == pytest.approx(NATURAL_FREQUENCY, rel=0.03)


def test_an_acceleration_that_points_down_is_turned(flight: Flight, tmp_path: Path) -> None:
    columns = np.column_stack((flight.time, flight.theta, -flight.z_ddot - 9.81))
    np.savetxt(tmp_path / "down.csv", columns, "%.7f", ",", header="time_s,theta_rad,nz_m_s2", comments="")
    summary = replayed(tmp_path / "out", tmp_path / "down.csv", "--map", "theta=theta_rad", "z_ddot=nz_m_s2")
    assert summary["recording"]["mapping"]["inputs"]["z_ddot"]["sign"] == -1
    assert "turned" in summary["verdict"]
    assert frequency(summary) == pytest.approx(NATURAL_FREQUENCY, rel=0.02)


def test_what_is_written_is_read_back(folder: Path, tmp_path: Path) -> None:
    every = ("--format", "csv,mf4,parquet")
    first = replayed(tmp_path / "first", folder / "columns.csv", "--map", *COLUMNS, *every)
    for name in ("trace.csv", "signals.mf4", "trace.parquet"):
        again = replayed(tmp_path / name, tmp_path / "first" / name)
        assert frequency(again) == pytest.approx(frequency(first), rel=1e-3)
        assert again["samples"] == first["samples"]


def test_tune_takes_the_same(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """At 500 Hz nothing is lost; and the command that it prints reads the log in the same way."""
    arguments = ["--dbc", folder / "foreign.dbc", "--map", *MAPPED, "-o", tmp_path / "my.settings", "--length", "21"]
    arguments += [word for name in readmes.KEPT.split() for word in ("--keep", name)]
    arguments += ["--page", tmp_path / "tune.html", "--clock", "z_ddot"]
    assert main(["tune", str(folder / "flight.log"), *map(str, arguments)]) == 0
    printed = capsys.readouterr()
    assert "gravity is in it, and is subtracted" in printed.err
    assert "sample_period = 0.002" in (tmp_path / "my.settings").read_text()
    assert " lost)" not in (tmp_path / "tune.html").read_text()
    words = shlex.split(printed.out.partition("Next:\n")[2].replace("\\\n", " "))
    assert {("--clock", "z_ddot"), ("--dbc", str(folder / "foreign.dbc"))} <= set(itertools.pairwise(words))
    assert main([*words[1:], "-o", str(tmp_path / "out"), "--format", "csv"]) == 0


# --- errors ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("mapped", "said"),
    [
        (("theta=Inceptor.LvrAngle",), "no message Inceptor; near to it: InceptorPosition"),
        (("theta=LvrAngel",), "no signal LvrAngel; near to it: LvrAngle"),
        (("angle=LvrAngle",), "the inputs are theta, theta_dot, z_ddot, tau_m, grip_force"),
        (("theta=AccLat",), "it is in g, which is no unit of angle"),
        (("theta=LvrAngle,unit=furlong",), "furlong is no unit of angle"),
        (("z_ddot=AccVert,gravity=out",), "gravity = out; it may be auto, included, none"),
        (("theta=LvrAngle,sign=2",), "sign = 2; it may be 1 or -1"),
        (("theta=LvrAngle,delay=4",), "delay = 4 s is more than a second"),
        (("theta=LvrAngle,delay=4 kg",), "delay = 4 kg; it must be a number, in s or with a unit of time"),
        (("theta=LvrAngle,factor=4 deg",), "factor = 4 deg; it must be a number"),
        (
            ("theta=LvrAngle", "z_ddot=AccLong"),
            "z_ddot = AhrsAccel.AccLong: it is 0.1961 m/s² throughout, so it is no measurement",
        ),
        (("theta=LvrAngle,unit=rad",), "is it in degrees"),
        (("theta=LvrAngle,channel=can7",), "InceptorPosition (0x18fef1fe) is not on can7, but on can0"),
        (("nothing.toml",), "cannot read nothing.toml: No such file"),
    ],
)
def test_what_is_wrong_with_a_mapping(mapped: tuple[str, ...], said: str, folder: Path, refused: Refused) -> None:
    arguments: list[str | Path] = ["--dbc", folder / "foreign.dbc", "--map", "z_ddot=AccVert", *mapped]
    assert said in refused("replay", folder / "flight.log", *arguments)


def test_what_is_missing(folder: Path, refused: Refused) -> None:
    log, dbc = folder / "flight.log", folder / "foreign.dbc"
    assert "add --dbc FILE" in refused("replay", log, "--map", *MAPPED)
    for suffix in ("csv", "parquet", "mat", "npz", "mf4", "blf"):
        nothing = folder / f"nothing.{suffix}"
        assert f"cannot read {nothing}: no such file" in refused("replay", nothing, "--map", *MAPPED)
    assert "`lever map" in refused("replay", log, "--dbc", dbc)
    assert "has no z_ddot" in refused("replay", log, "--dbc", dbc, "--map", "theta=LvrAngle")
    assert "no database of CAN messages" in refused("replay", log, "--dbc", log, "--map", *MAPPED)
    assert "no column Angel" in refused(
        "replay", folder / "columns.csv", "--map", "theta=Angel", "z_ddot=Vertical acc."
    )
    assert "--map theta=COLUMN" in refused("replay", folder / "columns.csv")
