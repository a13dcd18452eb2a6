"""What a replay says: each sentence of its verdict, each cell of its tables, and its summary from and to JSON."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from lever_cdkf.errors import LeverError
from lever_cdkf.firmware.config import Config
from lever_cdkf.firmware.quantities import quantities, recorded_name
from lever_cdkf.numeric.arrays import FloatArray
from lever_cdkf.replay import proof
from lever_cdkf.replay.comparison import Comparison
from lever_cdkf.replay.engine import Options, replay
from lever_cdkf.replay.recorded_run import Kept, RecordedRun
from lever_cdkf.replay.summary import failure, verdict, warning
from lever_cdkf.replay.timeline import Clocks
from lever_cdkf.report import summary_html
from lever_cdkf.report.bode import slow_trim
from lever_cdkf.report.run import Run
from lever_cdkf.results import summary as summaries
from lever_cdkf.results.summary import Difference, Mapped, MessageCounts, ReplaySummary, Snapshots, Stability
from lever_cdkf.signals.reading import Reading, Table
from python.conftest import Run as Command
from python.conftest import Session, simulated
from python.report.reading import Reader


@pytest.fixture(scope="module")
def summary(session: Session) -> ReplaySummary:
    return replay([session.log], Options())


def mapped(**changes: Any) -> Mapped:
    empty = Mapped({}, {}, "theta", 1e-3, 0, {}, 0, [])
    return replace(empty, **changes)


# --- the verdict -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"refused": 1234}, "1,234 frames were refused."),
        ({"ends_early": ["a.log: cut", "b.log: short"]}, "The log is incomplete: a.log: cut; b.log: short."),
        ({"gaps": 1, "longest_gap_s": 0.25}, "Samples are missing in one place, a gap of 0.25 s."),
        ({"gaps": 3, "longest_gap_s": 1.5}, "Samples are missing in 3 places, the longest gap 1.5 s."),
        (
            {"answers_of_other_contract": True},
            "The estimates in the log are of another version of lever.dbc, or of an unknown one (IDENTITY): they are "
            "not compared.",
        ),
        (
            {"corrupt_recorded_answers": 1500},
            "1,500 recorded estimates are corrupt (CRC or length): they are not compared.",
        ),
        ({"misplaced_answers": 7}, "7 recorded estimates do not belong to the sample before them."),
        (
            {"mapping": mapped(notes=["a is odd", "b is guessed"], unprotected_frames=2500)},
            "a is odd. b is guessed. 2,500 frames are unprotected: the mapping names no E2E profile for them.",
        ),
        (
            {"mapping": mapped(messages={"M": MessageCounts(5000, 1, 2, 3, 4), "N": MessageCounts(7)})},
            "Of 5,000 frames of M: 1 corrupt, 2 lost, 3 repeated, 4 undecoded.",
        ),
        (
            {"typical_step_s": 2e-3},
            "Samples come every 2 ms, but sample_period is 1 ms: add --set sample_period=0.002.",
        ),
    ],
)
def test_each_trouble_has_its_sentence(changes: dict[str, Any], words: str, summary: ReplaySummary) -> None:
    assert words not in verdict(summary)
    said = verdict(replace(summary, recording=replace(summary.recording, **changes)))
    assert words in said
    assert said.replace(words, "").replace("  ", " ").strip() == verdict(summary)


def test_why_frames_are_refused(summary: ReplaySummary) -> None:
    said = verdict(replace(summary, corrupt=1000, late=2, recording=replace(summary.recording, refused=1002)))
    assert (
        "1,002 frames were refused: 1,000 corrupt (CRC, length or value), 2 repeated or out of sequence (does the "
        "sender count each message from 0 to 15?)."
    ) in said


def test_too_short_to_judge(summary: ReplaySummary) -> None:
    assert "Too short to judge: 5.999 s of estimates, 15 s are needed." in verdict(summary)
    almost = replace(summary, recording=replace(summary.recording, duration_s=14.9996))
    assert "Too short to judge: 14.999 s of estimates, 15 s are needed." in verdict(almost)
    assert "Too short" not in verdict(replace(summary, flagged_share=0.0))
    long = replace(summary, recording=replace(summary.recording, duration_s=15.0))
    assert "Too short" not in verdict(long)
    silent = replace(summary, estimates={k: replace(each, last=None) for k, each in summary.estimates.items()})
    assert "Too short" not in verdict(silent)


@pytest.mark.parametrize(
    ("modes", "said"),
    [
        ({"align": 3.0, "run": 2.0}, "40 %"),
        ({"align": 1.0, "run": 0.5, "frozen": 0.5}, ""),
        ({"run": 5.0}, ""),
        ({}, ""),
    ],
)
def test_how_much_of_the_time_there_are_estimates(modes: dict[str, float], said: str, summary: ReplaySummary) -> None:
    words = f"Estimates exist for {said} of the time; elsewhere the first guess, or the last estimate, is shown."
    assert (words in verdict(replace(summary, modes_s=modes))) is bool(said)
    assert ("Estimates exist" in verdict(replace(summary, modes_s=modes))) is bool(said)


def test_why_a_replay_fails(summary: ReplaySummary) -> None:
    assert failure(summary) == ""
    silent = replace(
        summary,
        modes_s={"fault": 2.5},
        estimates={key: replace(each, last=None) for key, each in summary.estimates.items()},
        recording=replace(summary.recording, refused=4321),
    )
    assert failure(silent) == (
        "the estimator was in mode fault for 2.5 s, restarted too often and no estimate was published: samples "
        f"accepted: {summary.samples:,}, frames refused: 4,321"
    )
    assert verdict(silent).startswith(f"Trouble: {failure(silent)}.")


def test_the_warning_says_what_to_do(summary: ReplaySummary) -> None:
    warned = replace(summary, fault_shares={"mismatch": 0.3}, flagged_share=0.3)
    assert warning(warned, "lever tune x.log").startswith("Do not trust the estimates 30 % of the time: ")
    assert warning(warned, "lever tune x.log").endswith(" Next: lever tune x.log.")
    assert warning(summary, "lever tune x.log") == ""
    assert verdict(replace(summary, warning="Do not.")).startswith("Do not. ")


def test_a_clock_that_is_wrong_is_named_as_the_evidence_of_calibration(tmp_path: Path) -> None:
    log = simulated("steady", tmp_path, "duration=18 s").log
    for settings, words, step in (
        ({}, "set publish_test_ratios=1 to see the evidence", "lever tune LOG"),
        ({"publish_test_ratios": 1.0}, "evidence: clock", "check the time of the samples, and sample_period"),
    ):
        said = replay([log], Options(Config(settings={"sample_period": 1.1e-3, **settings}))).warning
        assert f"(100 % of the time; {words})" in said
        assert said.endswith(f" Next: {step}.")


STABLE = Stability({"clear": 5.0, "warning": 1.25, "alarm": 0.5}, -1.234, 0.56, 12.34, 6.0, 3.0, None, "bell")


@pytest.mark.parametrize(
    ("stability", "words"),
    [
        (
            STABLE,
            "With bell, the gain margin to collective bounce was least at 12.34 s: -1.23 ± 0.56 dB; warning for 1.25 s "
            "and alarm for 0.5 s.",
        ),
        (replace(STABLE, states_s={"clear": 6.0}), "-1.23 ± 0.56 dB; no alarm."),
        (
            replace(STABLE, unstable_s=2.0, least_true_margin_db=-1.5),
            " In truth the loop was unstable for 2 s, by up to 1.5 dB.",
        ),
        (replace(STABLE, least_margin_db=None), "With bell, the margin to collective bounce was never known."),
    ],
)
def test_the_margin_in_words(stability: Stability, words: str, summary: ReplaySummary) -> None:
    assert words in verdict(replace(summary, stability=stability))
    assert "collective bounce" not in verdict(summary)


@pytest.mark.parametrize(
    ("counts", "said"),
    [
        (None, ""),
        (Snapshots(), ""),
        (
            Snapshots(4, 4, last_equal_s=7.25),
            "The state is the recorded one to the bit at all of 4 snapshots, to 7.250 s.",
        ),
        (
            Snapshots(4, 1, 3, first_different_s=1.5),
            "The state is not the recorded one at 3 of 4 snapshots, first at 1.500 s: between it and the snapshot "
            "before, the log is not what the estimator received. From each of them the replay goes on with the "
            "recorded state.",
        ),
        (Snapshots(2, broken=2), "2 snapshots are not whole."),
        (
            Snapshots(1, begun_at_s=0.25, left_out=1234),
            "The log does not begin where the estimator did: replayed from the snapshot 0.250 s after its beginning "
            "(1,234 frames left out).",
        ),
        (Snapshots(3, not_compared="why"), "Its 3 snapshots of the state are not compared: why."),
    ],
)
def test_snapshots_in_words(counts: Snapshots | None, said: str) -> None:
    assert proof.in_words(counts) == said


# --- what is printed -------------------------------------------------------------------------------------------------


def test_each_cell_of_the_tables_is_of_the_summary(
    session: Session, summary: ReplaySummary, lever: Command, tmp_path: Path
) -> None:
    lever("replay", session.log, "--json", tmp_path / "rows.json")
    tables = json.loads((tmp_path / "rows.json").read_text())
    recording = summary.recording
    assert tables["recording"] == [
        {
            "bus": "lever", "duration [s]": recording.duration_s, "frames": recording.frames, "frames left out": "none",
            "refused": 0, "samples": summary.samples, "lost": 0, "corrupt or implausible": 0, "late": 0, "restarts": 0,
            "repeated frames": 0, "damaged lines": 0, "gaps": 0, "longest gap [s]": recording.longest_gap_s,
            "mean NIS [1]": None,
        }
    ]  # fmt: skip
    assert tables["estimates"] == [
        {
            "quantity": key, "unit": each.unit, "at end": each.last, "sigma": each.last_sigma, "least": each.least,
            "greatest": each.greatest,
        }
        for key, each in summary.estimates.items()
    ]  # fmt: skip
    assert [row["unit"] for row in tables["estimates"]] == ["kg", "N s/m", "N/m", "Hz", "1"]
    shares = {**summary.fault_shares, "any that warns": summary.flagged_share}
    assert tables["share of the time with each fault"] == [
        {"fault": name, "share [%]": None if share is None else 100.0 * share} for name, share in shares.items()
    ]
    compared = tables["replayed minus recorded estimates"]
    assert summary.comparison is not None
    assert [row["signal"] for row in compared] == list(summary.comparison.signals)
    assert all(row["samples"] == row["identical"] for row in compared)


def test_what_was_left_out_is_printed(session: Session, lever: Command, tmp_path: Path) -> None:
    log = tmp_path / "two.log"
    log.write_text("".join(f"{line}\n(0.5) lever 18FEF100#01\n(0.5) lever 700#01\n" for line in session.lines[:200]))
    _, out, _ = lever("replay", log)
    assert "200 extended" in out
    assert "200 other_identifiers" in out


def test_the_table_of_the_log_says_what_was_in_it(summary: ReplaySummary, session: Session) -> None:
    """Each row another number, so that none is taken for another."""
    numbers = {
        "frames": (101, "frames in the log", ""), "damaged_lines": (102, "damaged lines", ""),
        "refused": (103, "frames that the estimator refused", ""),
        "repeated": (104, "frames that repeat the one before", ""),
        "corrupt_recorded_answers": (105, "corrupt recorded estimates", "frames"),
        "misplaced_answers": (106, "recorded estimates of other samples", "frames"),
        "commands": (107, "COMMAND frames", ""), "gaps": (108, "gaps between samples", ""),
        "longest_gap_s": (1.25, "longest gap", "s"), "late_samples": (109, "samples not newer than the one before", ""),
        "clock_wraps": (110, "wraps of the sample time", ""),
        "clock_restarts": (111, "restarts of the sender's clock", ""),
        "recorder_clock_jumps": (112, "jumps of the recorder's clock", ""),
    }  # fmt: skip
    changed = {name: value for name, (value, _, _) in numbers.items()} | {"frames_left_out": {"other_buses": 113}}
    run = Run(session.result.trace, replace(summary, recording=replace(summary.recording, **cast(Any, changed))))
    (table,) = Reader(summary_html.recording_table(run)).tables
    assert table[0] == ["the log", "value", "unit"]
    expected = [[label, f"{value:g}", unit] for value, label, unit in numbers.values()]
    assert table[1:] == [*expected, ["left out: other buses", "113", "frames"]]
    simulation = Run(session.result.trace, session.result.summary)
    assert summary_html.recording_table(simulation) == summary_html.recorded(simulation) == ""
    assert summary_html.recorded(run) == "A log, replayed: bus lever."


# --- compared with what was recorded ---------------------------------------------------------------------------------


def compared(replayed: np.ndarray, recorded: np.ndarray, sigma: np.ndarray) -> Difference:
    columns = {}
    for each in quantities("lever"):
        for kind in ("estimate", "sigma"):
            columns[each.column(kind)] = np.full(len(replayed), np.nan)
    for name in ("theta_estimate_rad", "theta_dot_estimate_rad_s", "nis"):
        columns[name] = np.full(len(replayed), np.nan)
    columns |= {recorded_name(name): values for name, values in list(columns.items())}
    columns |= {"k_p_estimate_N_m": replayed, recorded_name("k_p_estimate_N_m"): recorded, "k_p_sigma_N_m": sigma}
    comparison, time = Comparison("lever"), 0.5 * np.arange(len(replayed), dtype=np.float64)
    for half in (slice(0, 3), slice(3, None)):
        comparison.add({"time_s": time[half], **{k: v[half] for k, v in columns.items()}})
    result = comparison.summary()
    assert result is not None
    assert result.signals["m_p"].samples == 0
    assert not result.identical
    assert result.in_words == (
        "Against the estimates that were recorded with the log, k_p differs most: rms 1.3 σ (3.61 N/m), at most 6 N/m "
        "at 1.5 s."
    )
    return result.signals["k_p"]


def test_differences_by_hand() -> None:
    replayed = np.array([100.0, 102.0, 103.0, 94.0, np.nan, 101.0])
    recorded = np.array([100.0, 100.0, 100.0, 100.0, 100.0, 105.0])
    found = compared(replayed, recorded, np.array([1.0, 2.0, 2.0, 3.0, 1.0, 0.0]))
    differences = np.array([0.0, 2.0, 3.0, -6.0, -4.0])
    in_sigma = np.array([0.0, 1.0, 1.5, -2.0])  # none where sigma is 0
    assert (found.unit, found.samples, found.identical_samples) == ("N/m", 5, 1)
    assert found.bias == pytest.approx(differences.mean())
    assert found.rms == pytest.approx(math.sqrt((differences**2).mean()))
    assert (found.largest, found.largest_at_s) == (-6.0, 1.5)
    assert found.rms_in_sigma == pytest.approx(math.sqrt((in_sigma**2).mean()))


# --- a long run for its page -----------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def minute() -> tuple[Kept, Any]:
    """Return what is kept of a minute at 100 Hz, in pieces."""
    rng = np.random.default_rng(5)
    time = 0.01 * np.arange(6000, dtype=np.float64)
    names = ("theta_estimate_rad", "z_ddot_measured_m_s2", "tau_m_measured_N_m", "theta_measured_rad", "nis")
    trace: dict[str, FloatArray] = {"time_s": time, **{name: rng.standard_normal(6000) ** 2 for name in names}}
    trace["theta_dot_measured_rad_s"] = np.where(time < 30.0, 0.0, np.nan)  # one output only, later
    result = Kept(0.01)
    for part in np.array_split(np.arange(6000), 7):
        result.add({name: np.asarray(values[part], np.float64) for name, values in trace.items()})
    return result, trace


def run_of(kept: Kept) -> RecordedRun:
    return RecordedRun(kept, cast(ReplaySummary, None))


def test_what_is_kept_is_what_there_was(minute: tuple[Kept, Any]) -> None:
    kept, trace = minute
    run = run_of(kept)
    whole = Run(trace, None)
    assert (run.samples, run.end, run.sample_period) == (6000, 59.99, 0.01)
    for name in ("z_ddot_measured_m_s2", "tau_m_measured_N_m"):
        for one, other in zip(run.spectrum(name), whole.spectrum(name), strict=True):
            np.testing.assert_allclose(one, other, rtol=1e-9)
    assert run.coherence is not None
    assert whole.coherence is not None
    np.testing.assert_allclose(run.coherence.spectrum()[1], whole.coherence.spectrum()[1])
    for start in (0.0, run.end - 2.0):
        close, all_of_it = run.close_up(start, 2.0), whole.close_up(start, 2.0)
        np.testing.assert_array_equal(close["nis"], all_of_it["nis"])


def test_innovations_of_quarters_of_a_second(minute: tuple[Kept, Any]) -> None:
    kept, trace = minute
    found, expected = run_of(kept).innovations(0.25), Run(trace, None).innovations(0.25)
    assert found is not None
    assert expected is not None
    assert found.seconds == 0.25
    for one, other in zip(found[:3], expected[:3], strict=True):
        np.testing.assert_allclose(one, other)
    nis = trace["nis"]
    assert found.total[3] == pytest.approx(nis[75:100].sum())
    assert (found.freedom[3], found.freedom[-1]) == (50.0, 25.0)
    assert found.time[3] == pytest.approx(0.87)
    assert Run({"time_s": np.arange(4.0)}, None).innovations(0.25) is None


def test_long_recordings_have_longer_averages() -> None:
    count = 260_000
    ones = np.ones(count)
    long = Kept(0.01)
    long.nis.add(0.01 * np.arange(count, dtype=np.float64), 2.0 * ones, 2.0 * ones)
    long.stretches.add({"time_s": np.arange(2.0)})
    found = run_of(long).innovations(0.25)
    assert found is not None
    assert found.seconds == 6 * 0.25  # 10400 quarters in at most 2000
    assert len(found.time) == 10400 // 6
    assert found.total / found.freedom == pytest.approx(1.0)
    assert found.freedom[0] == 6 * 25 * 2
    short = Kept(0.01)
    short.stretches.add({"time_s": np.arange(2.0)})
    assert run_of(short).innovations(0.25) is None


def test_the_trim_of_long_stretches_is_the_middle_of_their_extremes() -> None:
    """Followed slowly where stretches are short; taken as it is where they are long."""
    for period, is_long in ((0.001, False), (10.0, True)):
        kept = Kept(period)
        count = 100_000
        time: FloatArray = period * np.arange(count, dtype=np.float64)
        theta: FloatArray = 0.3 + 0.2 * (np.arange(count, dtype=np.float64) % 2)
        kept.stretches.add({"time_s": time, "theta_estimate_rad": theta})
        run = run_of(kept)
        run.sample_period = period
        assert kept.stretches.size > 1
        assert run.followed_trim is not None
        assert run.followed_trim == pytest.approx(0.4)
        assert len(run.followed_trim) == len(run.time)
        steps = theta.copy()
        steps[count // 2 :] += 0.1
        kept = Kept(period)
        kept.stretches.add({"time_s": time, "theta_estimate_rad": steps})
        run = run_of(kept)
        run.sample_period = period
        assert run.followed_trim is not None
        middle = np.repeat([0.4, 0.5], len(run.time) // 4)
        slow = slow_trim(run.time[0::2], middle, run.settings["trim_corner"])
        np.testing.assert_allclose(run.followed_trim[0::2], middle if is_long else slow, atol=1e-9)


# --- summary.json ----------------------------------------------------------------------------------------------------


def test_a_summary_is_read_back(summary: ReplaySummary, session: Session, tmp_path: Path) -> None:
    file = tmp_path / "summary.json"
    for each in (summary, session.result.summary):
        file.write_text(summaries.text(each), encoding="utf-8")
        assert summaries.read(file) == each
    assert json.loads(file.read_text())["schema"] == 1


Change = Callable[[dict[str, Any]], Any]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda content: content.update(schema=2), "schema 2, not 1: of another version"),
        (lambda content: content.update(samples="many"), "not a summary of this version: TypeError("),
        (lambda content: content.update(samples=True), "not a summary of this version: TypeError("),
        (lambda content: content.update(samples=1.5), "not a summary of this version: TypeError("),
        (lambda content: content.update(passed=None), "not a summary of this version: TypeError("),
        (lambda content: content.update(unknown=1), "not a summary of this version: TypeError("),
        (lambda content: content.pop("samples"), "not a summary of this version: TypeError("),
        (lambda content: content.pop("schema"), "not a summary of this version: KeyError('schema')"),
        (lambda content: content.update(nis=[]), "not a summary of this version: TypeError("),
        (lambda content: content["estimator"]["settings"].update(m_p="x"), "not a summary of this version: TypeError("),
    ],
)
def test_what_is_no_summary(change: Change, said: str, summary: ReplaySummary, tmp_path: Path) -> None:
    content = json.loads(json.dumps(asdict(summary)))
    change(content)
    file = tmp_path / "summary.json"
    file.write_text(json.dumps(content))
    with pytest.raises(LeverError) as error:
        summaries.read(file)
    assert str(error.value).startswith(f"{file}: {said}")


@pytest.mark.parametrize("text", ["", "[]", "3", "{", '{"schema": 1}', "[" * 100_000])
def test_other_files_are_no_summaries(text: str, tmp_path: Path) -> None:
    (tmp_path / "x.json").write_text(text)
    with pytest.raises(LeverError, match=r"x\.json: not a summary of this version: "):
        summaries.read(tmp_path / "x.json")
    with pytest.raises(LeverError, match=r"cannot read .*: No such file"):
        summaries.read(tmp_path / "none.json")


def test_whole_numbers_may_stand_for_others(summary: ReplaySummary) -> None:
    content = asdict(summary) | {"flagged_share": 1, "modes_s": {"run": 5}}
    read = summaries.of(ReplaySummary, content)
    assert (read.flagged_share, read.modes_s) == (1, {"run": 5})


def test_counts_begin_at_nothing() -> None:
    assert set(asdict(MessageCounts()).values()) == {0}
    assert set(asdict(Difference("kg")).values()) == {"kg", 0, None}
    assert set(asdict(Snapshots()).values()) == {0, None}
    assert set(asdict(Clocks()).values()) == {0}
    assert (Reading().start, Reading().length, Reading().is_of_lever_dbc) == (0.0, math.inf, False)
    table = Table(["a"])
    assert (table.damaged, table.ends_early, table.done, table.size) == (0, [], 1, 1)
