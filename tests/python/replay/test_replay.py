"""`lever replay`: the estimates of a simulation again, bit for bit, whatever else is in its log; and every file."""

from __future__ import annotations

import csv
import hashlib
import json
import math
import re
import shlex
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import can
import numpy as np
import pytest
from lever_cdkf.can import codec
from lever_cdkf.cli.formats import FORMATS
from lever_cdkf.cli.main import main
from lever_cdkf.errors import LeverError
from lever_cdkf.firmware.estimator import TEST_RATIOS
from lever_cdkf.replay import engine, reduction
from lever_cdkf.replay.outputs import FILES
from lever_cdkf.replay.summary import verdict
from lever_cdkf.report import summary_html
from lever_cdkf.results.summary import ReplaySummary, of
from lever_cdkf.tune import recording
from python.conftest import Refused, Run, Session, simulated
from python.report.reading import figures, first_number, read, unpack

Summary = dict[str, Any]

ALIGNING = 300
"""Samples at the start whose estimates may not be used."""
ALL = ("--format", ",".join(FORMATS))


@pytest.fixture(scope="module", autouse=True)
def _date() -> Iterator[None]:
    """Yield the date that all files say."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SOURCE_DATE_EPOCH", "1700000000")
        yield


def replayed(out: Path, *arguments: str | Path) -> Summary:
    """`lever replay … -o out`, which must do; returns its summary."""
    assert main(["replay", *map(str, arguments), "-o", str(out)]) == 0
    summary: Summary = json.loads((out / "summary.json").read_text())
    return summary


def settings_of(session: Session, folder: Path) -> Path:
    """Return the settings file that the simulation's firmware had."""
    path = folder / "session.settings"
    values = session.config.choices | session.config.settings
    path.write_text("".join(f"{name} = {value}\n" for name, value in values.items()))
    return path


@pytest.fixture(scope="module")
def replay(session: Session, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Summary]:
    out = tmp_path_factory.mktemp("replay") / "out"
    return out, replayed(out, session.log, *ALL)


def estimates(log: Path) -> list[tuple[str, str]]:
    """Return identifier and data of the estimator's frames in a log."""
    frames = [line.split()[2].split("#") for line in log.read_text().splitlines()]
    return [(identifier, data) for identifier, data in frames if identifier[0] == "2"]


# --- the same again --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["sensor_dropout", "linear_black_box", "fixed_preload"])
@pytest.mark.requirement("R52")
def test_the_log_of_a_simulation_is_reproduced_to_the_byte(name: str, tmp_path: Path) -> None:
    session = simulated(name, tmp_path / "sim")
    summary = replayed(tmp_path / "out", session.log, "--settings", settings_of(session, tmp_path))
    assert (tmp_path / "out/bus.log").read_bytes() == session.log.read_bytes()
    assert summary["comparison"]["identical"] is True
    assert all(signal["samples"] > 0 for signal in summary["comparison"]["signals"].values())
    assert "reproduced bit for bit" in summary["verdict"]


def columns(path: Path) -> dict[str, tuple[str, ...]]:
    """Return the text of each column of a trace.csv."""
    with path.open(newline="") as file:
        header, *rows = csv.reader(file)
    return dict(zip(header, zip(*rows, strict=True), strict=True))


def test_the_trace_is_that_of_the_simulation_without_the_truth(session: Session, replay: tuple[Path, Summary]) -> None:
    simulation, again = (columns(folder / "trace.csv") for folder in (session.folder, replay[0]))
    expected = [name for name in simulation if "_true" not in name]
    assert [name for name in again if "_recorded" not in name] == expected
    for name in expected:
        assert again[name] == simulation[name], name
    for name in ("k_p", "natural_frequency"):
        column = next(column for column in again if column.startswith(f"{name}_recorded"))
        assert again[column] == simulation[column.replace("recorded", "estimate")], name


def test_test_ratios_are_those_of_the_simulation(tmp_path: Path) -> None:
    """And are drawn, in both pages."""
    session = simulated("steady", tmp_path / "sim", "settings.publish_test_ratios=1")
    replayed(tmp_path / "out", session.log, "--settings", settings_of(session, tmp_path))
    simulation, again = (columns(folder / "trace.csv") for folder in (session.folder, tmp_path / "out"))
    for name in ("evidence", "test_ratio", "verdict"):
        assert again[name] == simulation[name], name
    assert set(simulation["evidence"]) - {""} == {str(number) for number in range(len(TEST_RATIOS))}
    for folder in (session.folder, tmp_path / "out"):
        assert "figure-test-ratios" in (folder / "report.html").read_text(encoding="utf-8")


def test_two_replays_are_equal_in_every_file(session: Session, replay: tuple[Path, Summary], tmp_path: Path) -> None:
    replayed(tmp_path / "again", session.log, *ALL)
    for name in FILES:
        first, second = ((folder / name).read_bytes() for folder in (replay[0], tmp_path / "again"))
        assert hashlib.sha256(first).digest() == hashlib.sha256(second).digest(), name
    assert sorted(path.name for path in replay[0].iterdir()) == sorted(FILES)
    assert (replay[0] / "bus.log").read_bytes() == session.log.read_bytes()


def test_another_format_gives_the_same_estimates(session: Session, tmp_path: Path) -> None:
    part, path = tmp_path / "part.log", tmp_path / "part.mf4"
    part.write_text("".join(f"{line}\n" for line in session.lines[:4000]))
    with can.LogReader(part) as reader, can.Logger(path) as logger:
        for message in reader:
            logger.on_message_received(message)
    summary = replayed(tmp_path / "out", path)
    assert summary["comparison"]["identical"] is True
    expected = estimates(part)
    assert estimates(tmp_path / "out/bus.log")[: len(expected)] == expected
    assert len(expected) > 1000


# --- what else is in a log -------------------------------------------------------------------------------------------


def test_other_traffic_and_doubled_frames_change_no_estimate(session: Session, tmp_path: Path) -> None:
    messy: list[str] = []
    for index, line in enumerate(session.lines):
        time, _, frame, direction = line.split()
        messy += [f"{time} can7 {frame}", line, f"{time} lever 18FEF100#0102030405060708", f"{time} lever 700#01"]
        messy += ["damaged"] if index % 100 == 7 else []
        messy += [line] if index % 50 == 8 and direction == "T" else []
        messy += [f"{time} lever 20000004#0004000000000000"] if index % 1000 == 9 else []
    log = tmp_path / "messy.log"
    log.write_text("".join(f"{line}\n" for line in messy))
    summary = replayed(tmp_path / "out", log, "--channel", "lever")
    recording, count = summary["recording"], len(session.lines)
    left_out = {"other_buses": count, "other_identifiers": count, "extended": count, "error": -(-(count - 9) // 1000)}
    assert recording["frames_left_out"] == left_out
    assert recording["damaged_lines"] == -(-(count - 7) // 100)
    assert recording["repeated"] == len(messy) - 4 * count - recording["damaged_lines"] - left_out["error"] > 50
    assert recording["other_buses_with_samples"] == ["can7"]
    assert recording["refused"] == recording["repeated"]
    assert recording["refused"] == summary["late"]
    assert (
        f"{recording['refused']} frames were refused: {summary['late']} repeated or out of sequence"
        in summary["verdict"]
    )
    parameters = [(i, d) for i, d in estimates(tmp_path / "out/bus.log") if i in ("210", "211", "212", "213")]
    assert parameters == [(i, d) for i, d in estimates(session.log) if i in ("210", "211", "212", "213")]


@pytest.mark.parametrize("command", [("replay",), ("monitor", "--once")])
def test_a_log_that_is_cut_off_is_used_with_a_warning(
    command: tuple[str, ...], session: Session, lever: Run, tmp_path: Path
) -> None:
    (tmp_path / "cut.log").write_bytes(session.log.read_bytes()[:200_017])
    status, _, err = lever(*command, tmp_path / "cut.log")
    assert status == 0
    assert re.fullmatch(r"lever: warning: The log is incomplete: .*cut\.log: its last line has no end\.\n", err)


def test_tune_says_of_a_log_that_it_is_cut_off(session: Session, tmp_path: Path) -> None:
    cut = tmp_path / "cut.log"
    cut.write_bytes(session.log.read_bytes()[:200_017])
    assert recording.read([cut]).notes == (f"The log is incomplete: {cut}: its last line has no end.",)
    assert recording.read([session.log]).notes == ()


def test_the_command_that_is_proposed_tunes_the_same_part(
    session: Session, refused: Refused, monkeypatch: pytest.MonkeyPatch
) -> None:
    proposed: list[str] = []

    def keep(_logs: object, asked: engine.Options, *_: object) -> None:
        proposed.append(asked.tune_command)
        raise LeverError("stop")

    monkeypatch.setattr(engine, "replay", keep)
    refused("replay", session.log, "--start", "1", "--length", "3")
    assert "too short to tune on: 3 s of samples" in refused(*shlex.split(proposed[0])[1:])


def test_gaps_and_restarts_are_told(session: Session, tmp_path: Path) -> None:
    lines = session.lines
    first = next(i for i, line in enumerate(lines) if line.startswith("(2.000000)"))
    later = next(i for i, line in enumerate(lines) if line.startswith("(2.700000)"))
    log = tmp_path / "gap.log"
    log.write_text("".join(f"{line}\n" for line in [*lines[:first], *lines[later:]]))
    summary = replayed(tmp_path / "out", log)
    assert summary["recording"]["gaps"] == 1
    assert summary["recording"]["longest_gap_s"] == pytest.approx(0.701)
    assert summary["samples"] == 6000 - 700
    assert "in one place, a gap of 0.701 s" in summary["verdict"]
    twice = tmp_path / "twice.log"
    shifted = [f"({float(line[1 : line.index(')')]) + 60.0:.6f}){line[line.index(')') + 1 :]}" for line in lines]
    twice.write_text("".join(f"{line}\n" for line in [*lines, *shifted]))
    summary = replayed(tmp_path / "out", twice)
    assert summary["recording"]["clock_restarts"] == 1
    assert summary["samples"] == 12000
    with (tmp_path / "out/trace.csv").open() as file:
        time = [float(row["time_s"]) for row in csv.DictReader(file)]
    assert time[6000] == pytest.approx(60.0, abs=1e-3)
    assert time == sorted(time)


# --- other settings --------------------------------------------------------------------------------------------------


def test_other_settings_give_other_estimates_and_are_compared(session: Session, tmp_path: Path) -> None:
    tables = tmp_path / "tables.json"
    summary = replayed(tmp_path / "out", session.log, "--set", "k_p_walk=0.2", "--json", tables)
    comparison = summary["comparison"]
    assert comparison["identical"] is False
    printed = {row["signal"]: row for row in json.loads(tables.read_text())["replayed minus recorded estimates"]}
    names = {
        "samples": "samples",
        "mean difference": "bias",
        "rms difference": "rms",
        "rms in sigma [1]": "rms_in_sigma",
    }
    assert printed.keys() == comparison["signals"].keys()
    for name, row in printed.items():
        assert {key: row[key] for key in names} == {key: comparison["signals"][name][own] for key, own in names.items()}
    with (tmp_path / "out/trace.csv").open() as file:
        rows = list(csv.DictReader(file))
    columns = {name: np.array([float(row[name] or "nan") for row in rows]) for name in rows[0]}
    for key, unit in (("k_p", "_N_m"), ("m_p", "_kg"), ("natural_frequency", "_Hz"), ("damping_ratio", "")):
        difference = columns[f"{key}_estimate{unit}"] - columns[f"{key}_recorded{unit}"]
        said = ~np.isnan(difference)  # from the first message on
        difference = difference[said]
        signal = comparison["signals"][key]
        assert signal["samples"] == len(difference) > len(rows) - ALIGNING - 20
        assert signal["identical_samples"] == int(np.sum(difference == 0.0)) < len(rows)
        assert signal["rms"] == pytest.approx(math.sqrt(np.mean(difference**2)), rel=1e-6)
        assert signal["bias"] == pytest.approx(np.mean(difference), rel=1e-6, abs=1e-12)
        assert abs(signal["largest"]) == pytest.approx(np.max(np.abs(difference)), abs=1e-9)
        in_sigma = difference / columns[f"{key}_sigma{unit}"][said]
        assert signal["rms_in_sigma"] == pytest.approx(math.sqrt(np.nanmean(in_sigma**2)), rel=1e-6)
    assert "Against the estimates that were recorded with the log" in summary["verdict"]


def test_a_choice_made_here_wins_over_the_commands_in_the_log(session: Session, tmp_path: Path) -> None:
    summary = replayed(tmp_path / "out", session.log, "--model", "linear_physical", "--estimator", "joint")
    assert summary["estimator"]["model"] == "linear_physical"
    assert summary["estimator"]["estimator"] == "joint"
    assert list(summary["estimates"]) == ["m", "c", "k", "natural_frequency", "damping_ratio"]
    assert summary["recording"]["commands"] == 6 * 4  # dither is kept alive
    assert summary["recording"]["commands_changed"] == 1
    command = (tmp_path / "out/bus.log").read_text().split()[2]
    fields = codec.decode(0x120, bytes.fromhex(command.split("#")[1]))[1]
    assert (fields["model"], fields["estimator"], fields["adaptation"], fields["request"]) == (15, 15, 2, 3)
    assert summary["comparison"]["signals"]["theta"]["samples"] == 6000 - ALIGNING
    assert summary["comparison"]["signals"]["m"]["samples"] == 0


@pytest.mark.parametrize("contract", [None, 1, 3])
def test_estimates_of_another_contract_are_not_compared(session: Session, tmp_path: Path, contract: int | None) -> None:
    """The first contract had no IDENTITY, and the same frames with other fields: their CRC is right all the same."""
    lines = [line for line in session.lines if line.split()[2][:3] != "217"]
    if contract is not None:
        version = {"firmware_major": 9, "firmware_minor": 0, "firmware_patch": 0, "contract": contract}
        page = codec.encode("IDENTITY", 0, {"page": 0, **version}).hex().upper()
        lines.insert(10, f"{lines[9].split()[0]} lever 217#{page} R")
    log = tmp_path / "old.log"
    log.write_text("".join(f"{line}\n" for line in lines))
    summary = replayed(tmp_path / "out", log)
    assert summary["comparison"] is None
    assert "they are not compared." in summary["verdict"]
    assert "recorded" not in (tmp_path / "out/trace.csv").read_text().partition("\n")[0]
    assert (tmp_path / "out/bus.log").read_bytes() == session.log.read_bytes()


def test_recorded_estimates_of_other_samples_are_told_and_not_compared(session: Session, tmp_path: Path) -> None:
    """A log in which each STATE_ESTIMATE stands behind the sample after its own."""
    shifted: list[str] = []
    waiting = None
    for line in session.lines:
        frame = line.split()[2]
        if frame.startswith("210#"):
            shifted += [waiting] if waiting else []
            waiting = line
        else:
            shifted.append(line)
    log = tmp_path / "shifted.log"
    log.write_text("".join(f"{line}\n" for line in shifted))
    summary = replayed(tmp_path / "out", log)
    assert summary["recording"]["misplaced_answers"] == 5999
    assert "5999 recorded estimates do not belong to the sample before them." in summary["verdict"]
    assert summary["comparison"]["signals"]["theta"]["samples"] == 0
    assert summary["comparison"]["signals"]["k_p"]["samples"] > 5000


def test_a_sender_that_never_counts_fails_and_is_told_why(
    session: Session, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """E2E counters that stand: after its first, every frame of a message is a repetition."""
    log, out = tmp_path / "never.log", tmp_path / "out"
    with log.open("w") as file:
        for line in session.lines:
            time, bus, frame, _ = line.split()
            identifier, data = int(frame[:3], 16), bytes.fromhex(frame[4:])
            if identifier in (0x110, 0x111):
                name, fields = codec.decode(identifier, data)
                content = {key: value for key, value in fields.items() if key not in ("crc", "counter")}
                file.write(f"{time} {bus} {frame[:4]}{codec.encode(name, 3, content).hex().upper()}\n")
    assert main(["replay", str(log), "-o", str(out)]) == 1
    shown = capsys.readouterr()
    why = "no estimate was published: samples accepted: 1, frames refused: 11,998"
    assert shown.err == f"lever: replay: {why}\n"
    assert "11,998 repeated or out of sequence (does the sender count each message from 0 to 15?)." in shown.out
    assert 'class="verdict bad"' in (out / "report.html").read_text()
    summary = json.loads((out / "summary.json").read_text())
    assert (summary["passed"], summary["samples"], summary["late"]) == (False, 1, 11998)
    assert why in summary["verdict"]
    header, row = (
        next(line for line in shown.out.splitlines() if line.split()[:1] == [word]).split() for word in ("bus", "lever")
    )
    assert "refused" in header
    assert "11998" in row


def test_it_says_when_the_recording_began(session: Session, tmp_path: Path) -> None:
    (tmp_path / "may.log").write_text(
        "".join(
            f"({1.7e9 + float(line[1:].split(')')[0]):.6f}){line.partition(')')[2]}\n" for line in session.lines[:2000]
        )
    )
    assert replayed(tmp_path / "out", tmp_path / "may.log")["recording"]["start"] == "2023-11-14 22:13:20 UTC"
    page = read(tmp_path / "out/report.html")
    assert "A log, replayed: bus lever from 2023-11-14 22:13:20 UTC on." in "".join(page.text)
    assert ["frames in the log", summary_html.number(2000), ""] in [row for table in page.tables for row in table]


def test_settings_that_the_firmware_refuses_are_one_line(session: Session, refused: Refused, tmp_path: Path) -> None:
    for bad in (["--set", "m_p=1000"], ["--model", "elastic"], ["--set", "k_q=1"], ["--settings", "absent"]):
        assert refused("replay", session.log, *bad, "-o", tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("part", "key", "value", "words"),
    [
        ("modes_s", "fault", 2.5, "Trouble: the estimator was in mode fault for 2.5 s, restarted too often."),
        ("recording", "ends_early", ["a.log: cut"], "The log is incomplete: a.log: cut."),
        ("recording", "damaged_lines", 3, "3 of its lines are not frames."),
        ("recording", "clock_restarts", 2, "The sender's clock started over 2 times."),
        ("recording", "model_changes", 1, "changes the model on the way"),
        ("recording", "typical_step_s", 1.06e-3, "is 1 ms: add --set sample_period=0.00106."),
        ("recording", "typical_step_s", 0.94e-3, "Samples come every 0.94 ms"),
    ],
)
def test_the_verdict_begins_with_what_is_wrong(
    part: str, key: str, value: object, words: str, replay: tuple[Path, Summary]
) -> None:
    summary = replay[1]
    assert words not in verdict(of(ReplaySummary, summary))
    assert words in verdict(of(ReplaySummary, summary | {part: summary[part] | {key: value}}))
    for step in (0.96e-3, 1.04e-3, 0.0):
        recording = summary["recording"] | {"typical_step_s": step}
        assert "Samples come" not in verdict(of(ReplaySummary, summary | {"recording": recording}))


# --- the files -------------------------------------------------------------------------------------------------------


def test_the_summary_says_what_the_simulations_does(session: Session, replay: tuple[Path, Summary]) -> None:
    replayed_summary, simulation, trace = replay[1], session.result.summary, session.result.trace
    assert replayed_summary["samples"] == simulation.samples
    assert replayed_summary["modes_s"] == simulation.modes_s
    assert replayed_summary["estimator"] == asdict(simulation.estimator)
    for key, column in (("k_p", "k_p_estimate_N_m"), ("damping_ratio", "damping_ratio_estimate")):
        assert replayed_summary["estimates"][key]["last"] == trace[column][-1]
        assert replayed_summary["estimates"][key]["greatest"] == np.nanmax(trace[column])
    assert replayed_summary["nis"]["mean"] is None  # shorter than what it takes to converge


def test_a_long_log_is_reduced_for_the_page_and_nowhere_else(
    session: Session, replay: tuple[Path, Summary], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where it comes in many pieces."""
    monkeypatch.setattr(reduction.Stretches.__init__, "__defaults__", (256,))
    monkeypatch.setattr(engine, "_ROWS_AT_ONCE", 700)
    assert replayed(tmp_path / "out", session.log) == replay[1]
    assert (tmp_path / "out/trace.csv").read_bytes() == (replay[0] / "trace.csv").read_bytes()
    short, whole = (figures(read(folder / "report.html")) for folder in (tmp_path / "out", replay[0]))
    assert list(short) == list(whole)
    assert len(json.dumps(short["figure-motion"])) < 0.6 * len(json.dumps(whole["figure-motion"]))
    assert short["figure-detail"] == whole["figure-detail"]
    assert short["figure-spectra"]["data"] == whole["figure-spectra"]["data"]


def test_the_page_has_all_but_truth(replay: tuple[Path, Summary]) -> None:
    page = read(replay[0] / "report.html")
    names = page.ids("section")
    assert names == [
        *("parameters", "dynamics", "explained", "comparison", "bode", "states", "excitation", "health", "numbers"),
        "made",
    ]
    curves = {trace["name"] for figure in figures(page).values() for trace in figure["data"]}
    assert {"recorded", "replayed", "measured", "estimate"} <= curves
    for trace in figures(page)["figure-comparison"]["data"]:
        assert unpack(trace["x"])[[0, -1]] == pytest.approx([0.0, replay[1]["samples"] * 1e-3], abs=2e-3)
    (at_the_end,) = (table for table in page.tables if "at the end, ± one σ" in table[0])
    assert [row[0].split()[-1] for row in at_the_end[1:]] == ["mass", "damping", "stiffness", "frequency", "ratio"]
    assert first_number(at_the_end[3][1]) == pytest.approx(replay[1]["estimates"]["k_p"]["last"], rel=5e-3)
    assert "truth" not in curves
    assert "Natural frequency at the end" in "".join(page.text)
    cells = {row[0]: row[1:] for table in page.tables for row in table}
    assert cells["theta"][1:3] == ["5\u2009700", "5\u2009700"]
