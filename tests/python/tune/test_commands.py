"""`lever tune` as people use it: what it prints, the settings file that all else takes, what is wrong in a line."""

from __future__ import annotations

import json
import re
import shlex
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from lever_cdkf.can import codec
from lever_cdkf.cli.main import main
from lever_cdkf.commands.tune import _as_recorded
from lever_cdkf.firmware.native import Config
from lever_cdkf.firmware.settings_file import make_config, read_assignments
from lever_cdkf.replay.engine import Options, replay
from lever_cdkf.tune import calibration, recording
from lever_cdkf.tune.calibration import NAMES
from python.conftest import Refused, Run
from python.report.reading import figures, read, unpack
from python.tune.conftest import NOISE, Simulate

FEW = ("--keep", "m_p_walk", "--keep", "c_p_walk", "--keep", "k_p_walk", "--keep", "walk_ceiling", "--keep")
QUICK = (*FEW, "robbins_monro_time")


@pytest.fixture(scope="module")
def tuned(steady_log: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with what a whole run of the command writes."""
    out = tmp_path_factory.mktemp("tuned")
    files = ["-o", str(out / "my.settings"), "--page", str(out / "tune.html"), "--json", str(out / "tune.json")]
    assert main(["tune", str(steady_log), *files]) == 0
    return out


def test_it_writes_a_settings_file_with_the_noise_of_the_log(tuned: Path) -> None:
    text = (tuned / "my.settings").read_text()
    found = read_assignments(tuned / "my.settings")
    for name in ("theta_noise", "theta_dot_noise"):
        assert found[name] == pytest.approx(NOISE[name], rel=0.02)
    assert "[rad] standard deviation of a theta sample; was 0.001" in text
    assert text.startswith("# lever-cdkf ")
    assert re.search(r"^# \S+ sha256:[0-9a-f]{64}$", text, re.MULTILINE), "of the log"
    assert "noise_window" not in found, "it stays as the user had it"
    assert make_config(found).settings["noise_window"] == 1.0


def test_what_it_prints_says_before_and_after_with_units(tuned: Path) -> None:
    tables = json.loads((tuned / "tune.json").read_text())
    noise = {row["name"]: row for row in tables["settings"]}
    assert noise["theta_noise"]["unit"] == "rad"
    assert noise["theta_noise"]["before"] == 0.001
    assert noise["theta_noise"]["verdict"] == "too large"
    assert noise["theta_noise"]["95 % from"] < noise["theta_noise"]["after"] < noise["theta_noise"]["to"]
    rows = {(row["part"], row["noise"]): row for row in tables["before and after"]}
    assert set(rows) == {(part, noise) for part in ("tuned on", "held out") for noise in ("as set", "estimated")}
    held = rows["held out", "as set"]
    assert held["gain [nat]"] > 0.5
    assert held["lnL after [nat]"] - held["lnL before [nat]"] == pytest.approx(held["gain [nat]"], abs=2e-4)
    assert abs(held["NIS after"] - 1.0) < 0.03 < abs(held["NIS before"] - 1.0)


def test_calibration_goes_into_the_settings_file(tuned: Path) -> None:
    """Its log has dither, and neither gain error nor delay nor friction."""
    text = (tuned / "my.settings").read_text()
    found = read_assignments(tuned / "my.settings")
    rows = {row["name"]: row for row in json.loads((tuned / "tune.json").read_text())["calibration"]}
    assert set(rows) == set(calibration.NAMES)
    for name, true in zip(calibration.NAMES, (1.0, 0.0, 0.0), strict=True):
        sigma = found[f"{name}_sigma"]
        assert (rows[name]["after"], rows[name]["sigma after"]) == (found[name], sigma)
        assert abs(float(found[name]) - true) < 3.0 * float(sigma), name
    assert "[1] accelerometer: measured over true; was 1" in text
    assert "tau_m_gain cannot be found" in " ".join(line.removeprefix("# ") for line in text.splitlines())


def test_the_page_holds_the_same(tuned: Path) -> None:
    page = read(tuned / "tune.html")
    text = "".join(page.text)
    for words in (
        "Lever CDKF: Settings from a log",
        "What the log says",
        "held out",
        "From the dither (± one standard deviation): z_ddot_gain",
    ):
        assert words in text
    assert {"theta_dot_process_noise", "lever_friction"} <= {row[0] for table in page.tables for row in table}
    drawn = figures(page)
    assert list(drawn) == ["intervals", "sizes", "correlation"]
    rows = json.loads((tuned / "tune.json").read_text())["settings"][::-1]
    intervals: dict[str, list[dict[str, Any]]] = {"not contradicted": [], "before": [], "after": []}
    for trace in drawn["intervals"]["data"]:
        intervals[trace["name"]].append(trace)
    for lane, (row, bar, before, after) in enumerate(zip(rows, *intervals.values(), strict=True)):
        assert unpack(before["x"]) == 1.0
        assert unpack(after["x"]) == pytest.approx(row["after"] / row["before"], rel=1e-4)
        ends = [end and end / row["before"] for end in (row["95 % from"], row["to"])]
        assert all(
            end is None or end == pytest.approx(x, rel=1e-4) for end, x in zip(ends, unpack(bar["x"]), strict=True)
        )
        assert {*unpack(bar["y"]), *unpack(before["y"]), *unpack(after["y"])} == {lane}
    rows = json.loads((tuned / "tune.json").read_text())["before and after"]
    (held,) = (row for row in rows if (row["part"], row["noise"]) == ("held out", "as set"))
    sizes = {name: [t for t in drawn["sizes"]["data"] if t["name"] == name] for name in ("before", "after")}
    for name, (theta, theta_dot) in sizes.items():
        assert unpack(theta["x"])[:3] == pytest.approx([0.5, 1.5, 2.5])
        mean = np.mean([np.square(unpack(curve["y"])) for curve in (theta, theta_dot)])
        assert mean == pytest.approx(held[f"NIS {name}"], rel=0.02)
    correlation = [trace for trace in drawn["correlation"]["data"] if trace["name"] == "after"]
    assert unpack(correlation[0]["x"]) == pytest.approx(0.02 * np.arange(1, 26))
    assert np.abs(unpack(correlation[0]["y"])).max() == pytest.approx(abs(held["corr. after"]), abs=1e-3)


def test_sim_and_the_process_take_the_file(tuned: Path, lever: Run, build_dir: Path, tmp_path: Path) -> None:
    """With it, innovations in the simulation are as large as the filter expects, noise not being estimated."""
    file, out = tuned / "my.settings", tmp_path / "run"
    run = ("--set", "duration=12 s", "--set", "converged_after=6 s", "--set", "settings.noise_window=0 s")
    sensors = ("--set", "sensors.theta.noise=0.5 mrad", "--set", "sensors.theta_dot.noise=20 mrad/s")
    lever("sim", "steady", "--settings", file, *run, *sensors, "--out", out)
    summary = json.loads((out / "summary.json").read_text())
    assert summary["estimator"]["settings"]["theta_noise"] == read_assignments(file)["theta_noise"]
    assert summary["nis"]["mean"] == pytest.approx(2.0, abs=0.15)
    process = [str(build_dir / "lever_can"), "--settings", str(file), "--can", "no_such_can"]
    said = subprocess.run(process, capture_output=True, text=True, check=False).stderr
    assert "no_such_can" in said
    assert "settings" not in said


def test_other_sample_periods_are_noticed(tmp_path: Path, lever: Run) -> None:
    log = tmp_path / "slow.log"
    write_log(log, count=3000, period_us=10_000)
    status, out, err = lever("tune", log, *QUICK, "-o", tmp_path / "slow.settings", "--held-out", "0")
    assert status == 0
    assert "lever: tune: the log has a sample each 10 ms: sample_period becomes that (was 1 ms)" in err.splitlines()
    assert "lever_friction stay as they are: without dither they cannot be known." in out
    assert not set(calibration.NAMES) & set(read_assignments(tmp_path / "slow.settings"))
    assert read_assignments(tmp_path / "slow.settings")["sample_period"] == 0.01


@pytest.mark.parametrize(
    ("period_us", "resolution_us", "set_to"), [(1300, 1000, 1.3e-3), (1045, 1, 1e-3), (1055, 1, 1e-3)]
)
def test_tune_and_replay_find_the_same_period(
    period_us: int, resolution_us: int, set_to: float, tmp_path: Path
) -> None:
    """Also where most of its stamps are a millisecond apart, and up to the same difference from sample_period."""
    log, assignments = tmp_path / "some.log", {"sample_period": set_to}
    write_log(log, 3000, period_us, resolution_us=resolution_us)
    summary = replay([log], Options(Config(settings=assignments)))
    recorded = recording.read([log], period=set_to)
    assert recorded.period == pytest.approx(1e-6 * period_us, rel=1e-3)
    assert recorded.period == pytest.approx(summary.recording.typical_step_s, abs=1e-6)
    is_other = "Samples come every" in summary.verdict
    assert is_other == (period_us == 1055)
    assert (_as_recorded(assignments, recorded) != assignments) == is_other


def test_the_next_command_reads_the_log_as_this_one(tmp_path: Path, lever: Run) -> None:
    """From the same bus of it, and by the same identifiers."""
    log, out = tmp_path / "two buses.log", tmp_path / "my.settings"
    for bus in ("can1", "can0"):
        write_log(tmp_path / bus, count=3000, period_us=10_000, bus=bus, offset=0x40 if bus == "can0" else 0)
    lines = sorted(line for bus in ("can0", "can1") for line in (tmp_path / bus).read_text().splitlines())
    log.write_text("\n".join(lines) + "\n")
    options = ("--channel", "can0", "--id-offset", "0x40")
    _, printed, _ = lever("tune", log, *options, *QUICK, "-o", out, "--held-out", "0")
    words = shlex.split(printed.partition("Next:\n")[2].replace("\\\n", " "))
    assert words[:3] == ["lever", "replay", str(log)]
    status, printed, _ = lever(*words[1:], "-o", tmp_path / "replayed")
    assert status == 0
    summary = json.loads((tmp_path / "replayed/summary.json").read_text())
    assert summary["samples"] == 3000
    assert summary["estimator"]["settings"]["theta_noise"] == read_assignments(out)["theta_noise"]


def test_choices_are_those_of_the_log(tmp_path: Path, lever: Run) -> None:
    """A COMMAND in the log says which model was estimated, if nobody says otherwise."""
    lever("sim", "linear_physical", "--set", "duration=25 s", "--out", tmp_path)
    searched = ("m_walk", "c_walk", "k_walk", "m_p_walk", "c_p_walk", "k_p_walk", "walk_ceiling", "robbins_monro_time")
    keep = [part for name in (*searched, *NOISE) for part in ("--keep", name)]
    out = tmp_path / "x.settings"
    _, _, err = lever("tune", tmp_path / "bus.log", "-o", out, *keep, "--held-out", "0")
    assert "lever: tune: by COMMAND in the log, model is linear_physical" in err.splitlines()
    assert read_assignments(out)["model"] == "linear_physical"
    _, _, err = lever("tune", tmp_path / "bus.log", "-o", out, *keep, "--held-out", "0", "--set", "model=lever")
    assert "by COMMAND in the log, model" not in err
    assert read_assignments(out)["model"] == "lever"


def write_log(
    path: Path,
    count: int,
    period_us: int = 1000,
    bus: str = "can0",
    counts: bool = True,
    offset: int = 0,
    resolution_us: int = 1,
) -> None:
    """candump's format: a lever that swings a little, with noise; `counts`: the E2E counters do.

    `resolution_us` is that of the sender's clock.
    """
    lever_sample, base_sample = codec.encoder("LEVER_SAMPLE"), codec.encoder("BASE_SAMPLE")
    noise = np.random.default_rng(1).standard_normal((count, 3)) * (1e-3, 1e-2, 1.0)
    with path.open("w", encoding="ascii") as log:
        for k, (theta, theta_dot, z_ddot) in enumerate(noise.tolist()):
            time = k * period_us
            counter = k if counts else 3
            lever = lever_sample(counter, 0.35 + theta, theta_dot, 0.0)
            lines = (0x110 + offset, lever), (0x111 + offset, base_sample(counter, z_ddot, time - time % resolution_us))
            for identifier, data in lines:
                log.write(f"({time / 1e6:.6f}) {bus} {identifier:03X}#{data.hex().upper()}\n")


@pytest.mark.parametrize(
    ("content", "arguments", "line"),
    [
        ("", (), "holds no CAN frame"),
        ("(0.0) can0 123#00\n", (), "but no sample (0x111 BASE_SAMPLE) in them; its buses: can0"),
        ("(0.0) can0 111#0000000000000000\n", (), "but no sample (0x111 BASE_SAMPLE) in them; its buses: can0"),
        (None, (), "too short to tune on: 2 s of samples; at least 20 s are needed"),
        (None, ("--channel", "can7"), "but no sample (0x111 BASE_SAMPLE) on bus can7 in them; its buses: can0"),
        (None, ("--held-out", "0.9"), "--held-out 0.9: must be from 0 to 0.8"),
        (None, ("--length", "0"), "length must be more than 0"),
        (None, ("--start", "100"), "there is nothing from 100 s on (--start)"),
        (None, ("--page", "/no/such/x.html"), "cannot write /no/such/x.html: No such file or directory"),
        (None, ("--keep", "theta_nois"), "unknown setting 'theta_nois'; did you mean theta_noise?"),
        (None, ("--set", "theta_noise=9"), "theta_noise = 9.0 is out of range"),
    ],
)
def test_what_is_wrong_is_said_in_a_line(
    content: str | None, arguments: tuple[str, ...], line: str, refused: Refused, tmp_path: Path
) -> None:
    log, output = tmp_path / "x.log", tmp_path / "x.settings"
    if content is None:
        write_log(log, 2000)
    else:
        log.write_text(content)
    assert line in refused("tune", log, "-o", output, *arguments)
    assert not output.exists()


def test_a_sender_that_never_counts_is_told(tmp_path: Path, refused: Refused) -> None:
    write_log(tmp_path / "x.log", 2000, counts=False)
    line = refused("tune", tmp_path / "x.log", "-o", tmp_path / "x.settings")
    why = "3,998 repeated or out of sequence (does the sender count each message from 0 to 15?)"
    assert line.endswith(f"x.log: too few samples to tune on, 1: {why}\n")
    assert not (tmp_path / "x.settings").exists()


def test_worse_on_the_part_held_out_writes_nothing(simulate: Simulate, tmp_path: Path, lever: Run) -> None:
    """Two runs on end, the second with three times the noise: told by exit status, and no file."""
    quiet, loud = (simulate(20.0, theta_noise=noise).read_text().splitlines() for noise in (0.5e-3, 3e-3))
    log, output = tmp_path / "two.log", tmp_path / "two.settings"
    log.write_text("\n".join(quiet) + "\n" + "\n".join(_shifted(line, 20.0) for line in loud) + "\n")
    kept = ("theta_dot_noise", "theta_dot_process_noise", *NAMES)
    quickly = (*QUICK, *(word for name in kept for word in ("--keep", name)))
    status, _, err = lever("tune", log, "-o", output, *quickly, "--set", "noise_window=0", "--held-out", "0.62")
    assert (status, output.exists()) == (1, False)
    assert "do worse on the part held out" in err


def _shifted(line: str, seconds: float) -> str:
    """Return a line of candump's, recorded later."""
    time, _, rest = line.removeprefix("(").partition(")")
    return f"({float(time) + seconds:.6f}){rest}"
