"""A log with snapshots begins anywhere, is replayed from there, and every stretch of it proves itself; a flipped bit is
found."""

from __future__ import annotations

import os
import random
from pathlib import Path
from typing import Any

import pytest
from lever_cdkf.can import codec
from lever_cdkf.firmware.native import Config, lib
from lever_cdkf.replay.engine import Options, replay
from lever_cdkf.results.summary import ReplaySummary, Snapshots
from lever_cdkf.signals.reading import Reading
from lever_sil.run import buslog
from lever_sil.run.runner import simulate
from lever_sil.scenarios.scenario import Scenario, load

CUTS = int(os.environ.get("LEVER_CUTS", "12"))
"""Places at which the log is cut; 1,000 once: replay/README.md."""
FRAMES = 2 + -(-lib.LEVER_STATE_BYTES // 6)
"""Of a snapshot."""
FLIPS = int(os.environ.get("LEVER_CUTS", "25"))


def flight(scenario: Scenario) -> list[str]:
    """Return its log, with a snapshot each half second."""
    frames = simulate(scenario, snapshots=0.5).frames
    return b"".join(buslog.lines(frames, "lever")).decode().splitlines(keepends=True)


@pytest.fixture(scope="module")
def lines() -> list[str]:
    return flight(load("re_trim", ["duration=5.8 s", "converged_after=1 s"]))


def counts(lines: list[str], folder: Path, **options: Any) -> tuple[Snapshots, ReplaySummary]:
    log = folder / "part.log"
    log.write_text("".join(lines))
    summary = replay([log], Options(**options))
    assert summary.snapshots is not None
    return summary.snapshots, summary


def seconds(line: str) -> float:
    return float(line[1 : line.index(")")])


def test_the_whole_log_is_proved_from_its_beginning(lines: list[str], tmp_path: Path) -> None:
    found, summary = counts(lines, tmp_path)
    assert (found.equal, found.different, found.broken, found.begun_at_s) == (11, 0, 0, None)
    assert "to the bit at all of 11 snapshots" in summary.verdict


@pytest.mark.requirement("R53")
def test_any_cut_replays_and_proves_itself_within_a_second(lines: list[str], tmp_path: Path) -> None:
    """But where less than the snapshot to begin with, the one to be compared and its end are left."""
    source = random.Random(1)
    end = next(place for place, line in enumerate(lines) if seconds(line) > seconds(lines[-1]) - 2.0)
    for _ in range(CUTS):
        part = lines[source.randrange(end) :]
        first = seconds(part[0])
        found, summary = counts(part, tmp_path)
        assert found.different == 0
        assert found.equal >= 1
        begun = found.begun_at_s or 0.0
        assert begun <= 0.501
        assert summary.comparison is not None
        assert summary.comparison.identical
        with_two = [line for line in part if seconds(line) <= first + begun + 1.0]  # its snapshot, and another's end
        assert counts(with_two, tmp_path)[0].equal >= (1 if found.begun_at_s is not None else 0)


def flipped(line: str, source: random.Random) -> str:
    """With one bit of identifier or data other than it was."""
    head, frame, end = line.partition(" lever ")[0], *line.partition(" lever ")[2].split(" ")
    identifier, data = frame.split("#")
    bit = source.randrange(11 + 64)
    if bit < 11:
        return f"{head} lever {int(identifier, 16) ^ 1 << bit:03X}#{data} {end}"
    return f"{head} lever {identifier}#{int(data, 16) ^ 1 << bit - 11:016X} {end}"


def test_one_flipped_bit_is_found(lines: list[str], tmp_path: Path) -> None:
    """In an input by the state, from the next snapshot on equal again; in what the estimator sent by its CRC."""
    source = random.Random(2)
    before, _ = counts(lines, tmp_path)
    inputs = {codec.message(name).frame_id for name in ("LEVER_SAMPLE", "BASE_SAMPLE", "GRIP_SAMPLE", "COMMAND")}
    compared = next(place for place, line in enumerate(lines) if seconds(line) >= 5.0)  # the last whole snapshot's
    for _ in range(FLIPS):
        place = source.randrange(compared)
        spoilt = lines.copy()
        spoilt[place] = flipped(lines[place], source)
        found, summary = counts(spoilt, tmp_path)
        was, now = (int(line.split()[2].split("#")[0], 16) for line in (lines[place], spoilt[place]))
        left_out = summary.recording.frames_left_out.get("other_identifiers", 0)
        corrupt = summary.recording.corrupt_recorded_answers
        if was in inputs or now in inputs:
            assert found.different or found.begun_at_s is not None, (lines[place], spoilt[place])
            assert found.different <= 1
            at = found.first_different_s or found.begun_at_s or 0.0
            assert 0.0 <= at - seconds(lines[place]) <= 0.501
        else:
            assert corrupt + left_out == 1, (lines[place], spoilt[place])
            assert (f"{corrupt} recorded estimates are corrupt" in summary.verdict) == (corrupt > 0)
        assert found.equal >= before.equal - 2


def test_what_is_lost_of_the_snapshots_themselves(lines: list[str], tmp_path: Path) -> None:
    """Without a part of its state a snapshot still says whether the replay is equal; without its end it does not."""
    of_snapshots = [place for place, line in enumerate(lines) if " 21D#" in line]
    without_data, without_end = (
        [line for place, line in enumerate(lines) if place != of_snapshots[nth]] for nth in (FRAMES + 5, 2 * FRAMES - 1)
    )
    assert counts(without_data, tmp_path)[0].equal == 11
    found, summary = counts(without_end, tmp_path)
    assert (found.equal, found.broken) == (10, 1)
    assert "1 snapshots are not whole" in summary.verdict
    doubled = [each for line in lines for each in ([line, line] if " 21D#" in line else [line])]
    assert counts(doubled, tmp_path)[0].equal == 11


def test_snapshots_that_come_late(lines: list[str], tmp_path: Path) -> None:
    """As on a bus, where samples have the right of way."""
    late = sorted((seconds(line) + (0.0055 if " 21D#" in line else 0.0), place) for place, line in enumerate(lines))
    moved = [lines[place] for _, place in late][3000:]
    found, summary = counts(moved, tmp_path)
    assert found.begun_at_s is not None
    assert (found.different, found.broken) == (0, 0)
    assert summary.comparison is not None
    assert summary.comparison.identical


def test_other_settings_and_choices_are_not_compared(lines: list[str], tmp_path: Path) -> None:
    found, summary = counts(lines[4000:], tmp_path, config=Config(settings={"theta_noise": 0.01}))
    assert (found.equal, found.different, found.begun_at_s) == (0, 0, None)
    assert "of other settings" in summary.verdict
    for part in (lines, lines[4000:]):
        other = {"config": Config(estimator="joint"), "chosen": {"estimator": "joint"}}
        found, summary = counts(part, tmp_path, **other)
        assert (found.equal, found.different, found.begun_at_s) == (0, 0, None)
        assert "other choices were made for the replay" in summary.verdict
    assert counts(lines[4000:], tmp_path, chosen={"estimator": "dual"})[0].equal > 0


def test_choices_before_the_log_are_told(tmp_path: Path) -> None:
    """A COMMAND that is not in the part has chosen the model."""
    scenario = load("linear_physical", ["duration=3 s", "converged_after=1 s"])
    found, summary = counts(flight(scenario)[5000:], tmp_path, config=Config(settings=scenario.config.settings))
    assert found.begun_at_s is not None
    assert found.different == 0
    assert summary.estimator.model == "linear_physical"


def test_a_part_by_its_time(lines: list[str], tmp_path: Path) -> None:
    """COMMANDs before it come first; they are in the state of the snapshot."""
    found, summary = counts(lines, tmp_path, reading=Reading(start=3.3, is_of_lever_dbc=True))
    assert summary.recording.commands > 0
    assert found.begun_at_s == pytest.approx(0.2, abs=0.002)
    assert (found.equal, found.different) == (3, 0)


def test_a_log_without_any_is_as_before(lines: list[str], tmp_path: Path) -> None:
    log = tmp_path / "without.log"
    log.write_text("".join(line for line in lines if " 21D#" not in line))
    assert replay([log], Options()).snapshots is None
