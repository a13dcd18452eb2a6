"""`lever envelope`: a reduced part of the table must hold in every test run."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from lever_cdkf.cli.main import main
from lever_cdkf.firmware.config import Config
from lever_sil.acceptance import table
from lever_sil.acceptance.excerpt import Excerpt
from lever_sil.acceptance.result import Limit
from lever_sil.batch import firmware
from lever_sil.batch.firmware import ClosedLoop
from lever_sil.batch.motions import Motion
from lever_sil.envelope import conditions, envelope_page, rules, run_conditions
from lever_sil.envelope.condition import Condition
from lever_sil.envelope.measure import fault_mask
from python.conftest import Refused

QUICK = {
    "steady", "sway_5deg_0.3hz", "retrim", "rest_20s", "base_invalid", "base_stuck", "theta_stuck", "spikes",
    "only_rate",
}  # fmt: skip


@pytest.mark.requirement("R1", "R6", "R32", "R34")
def test_the_reduced_table_holds(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], record_property: Callable[[str, object], None]
) -> None:
    status = main(["envelope", "--quick", "--out", str(tmp_path), "--json", str(tmp_path / "rows.json")])
    printed = capsys.readouterr().out
    rows = {row["name"]: row for row in json.loads((tmp_path / "rows.json").read_text(encoding="utf-8"))["rows"]}
    written = (tmp_path / "envelope.html").read_text(encoding="utf-8")
    assert set(rows) == QUICK
    for name, row in rows.items():
        assert row["measured"].keys() == row["limit"].keys()
        of = {
            (" " if over == "all runs" else f", {over} ").join((each["figure"], f"[{each['unit']}]")): each[over]
            for each in row["figures"]
            for over in ("all runs", "median", "p90", "worst")
        }
        assert row["measured"].items() <= of.items()
        for figure, value in row["measured"].items():
            record_property(f"{name}, {figure}", f"{value:.3g}")
        assert name in printed
        assert f'id="chart-{name}"' in written
    assert {name: row["measured"] for name, row in rows.items() if not row["ok"]} == {}
    assert status == 0


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    """Replace the table by three short rows: one cannot hold, one needs a setting that is unknown, and one is
    reported."""
    motion = Motion(duration=3.0)
    rows = (
        Condition("missed", "title", motion, (Limit("f_n rms", most=-1.0),), start=1.0),
        Condition("unknown", "title", motion, (Limit("f_n rms", most=9.0),), settings={"no_such": 1.0}, start=1.0),
        Condition("reported", "title", motion, start=1.0),
    )
    monkeypatch.setattr(conditions, "CONDITIONS", {row.name: row for row in rows})
    further = (Condition(name, "title", motion, start=1.0) for name in ("first", "second"))
    monkeypatch.setattr(rules, "RULES", {row.name: row for row in further})


def test_a_run_is_the_same_whoever_is_simulated_beside_it(monkeypatch: pytest.MonkeyPatch) -> None:
    rows = [
        Condition("sway", "", Motion(duration=3.0, trim=conditions.sway(3.0, 0.3)), start=1.0),
        Condition("steady", "", Motion(duration=3.0, friction=0.1), start=1.0),
    ]
    together = run_conditions.run(rows, {}, 3, lambda *_: None)
    monkeypatch.setattr(run_conditions, "LANE_SECONDS", 6.0)
    shown: list[tuple[int, int, str]] = []
    apart = run_conditions.run(rows, {}, 3, lambda *progress: shown.append(progress))
    assert {what for _, _, what in shown} == {"simulating", "sway", "steady"}
    assert all(0 <= done < total for done, total, _ in shown)
    for left, right in zip(together, apart, strict=True):
        assert left.condition is right.condition
        assert left.runs == right.runs == ["seed 0", "seed 1", "seed 2"]
        assert len(left.values["f_n rms"]) == 3
        for name, values in left.values.items():
            np.testing.assert_allclose(values, right.values[name], rtol=1e-9)


def test_every_row_of_the_rules_is_measured() -> None:
    """All figures are numbers; times may be infinite."""
    results = run_conditions.run(list(rules.RULES.values()), {}, 1, lambda *_: None)
    for result in results:
        assert result.problem == ""
        assert not any(np.isnan(values).any() for values in result.values.values())
        assert len(result.values["f_n rms"]) == result.condition.runs
    jumps = {
        result.condition.name: result.values["settled"] for result in results if result.condition.motion.k_p != 1.0
    }
    assert jumps.keys() == {"jump_k_1.4", "jump_ck_1.3_base_only", "jump_k_0.6"}
    assert all(0.0 < settled < 30.0 for settled in jumps.values())


@pytest.mark.parametrize("whole", [False, True])
def test_the_firmware_dithers_the_lever_while_samples_are_lost(whole: bool) -> None:
    motion, loop = Motion(duration=4.0, torque=()), ClosedLoop(dither=0.3, lost=0.5, whole=whole)
    recording, track = firmware.closed_loop(Config(), motion, range(2), loop, lambda: None)
    assert np.all(np.std(recording.tau_m[2000:], axis=0) > 0.15)
    missing = np.mean(track.faults & fault_mask("THETA") != 0)
    assert missing == 0.0 if whole else 0.4 < missing < 0.6
    assert np.any(track.faults & fault_mask("GAP")) == whole
    assert np.all(np.diff(track.value["f_n"][200:], axis=0).any(axis=0))
    assert track.feedthrough is None, "it is not noted in the loop"


def test_a_condition_has_the_dither_and_the_losses_that_it_says() -> None:
    motion = Motion(duration=3.0, torque=())
    loops = {"usual": ClosedLoop(), "none lost": ClosedLoop(lost=0.0), "no dither": ClosedLoop(dither=0.0)}
    rows = [Condition(name, "", motion, start=1.0, closed_loop=loop) for name, loop in loops.items()]
    found = [result.values["f_n rms"] for result in run_conditions.run(rows, {}, 1, lambda *_: None)]
    assert len(np.unique(found)) == len(rows)


@pytest.mark.usefixtures("short")
def test_what_misses_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["envelope", "--seeds", "2", "--out", str(tmp_path), "--json", str(tmp_path / "rows.json")]) == 1
    rows = {row["name"]: row for row in json.loads((tmp_path / "rows.json").read_text(encoding="utf-8"))["rows"]}
    assert {name: row["ok"] for name, row in rows.items()} == {"missed": False, "unknown": False, "reported": True}
    assert rows["unknown"]["measured"] == {"f_n rms [%]": None}
    assert "no_such" in rows["unknown"]["problem"]
    assert rows["missed"]["runs"] == 2
    printed = capsys.readouterr().out
    assert "0 of 2 conditions hold. Missed: missed, unknown." in printed
    assert re.search(r"^reported +reported ", printed, re.MULTILINE)
    assert table.MISSED in printed
    assert f"Written to {tmp_path}: envelope.html" in " ".join(printed.split())


@pytest.mark.usefixtures("short")
def test_without_out_no_file_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["envelope", "--only", "reported", "--seeds", "1"]) == 0
    assert list(tmp_path.iterdir()) == []
    assert "Written" not in capsys.readouterr().out


def test_a_figure_shows_on_which_side_of_its_limit_it_is() -> None:
    limits = (Limit("f_n largest", most=1.0), Limit("f_n largest", most=2.0, over="worst"))
    condition = Condition("steady", "", limits=limits)
    result = run_conditions.EnvelopeResult(condition, dict.fromkeys(condition.figures, np.array([0.5, 1.0004])))
    (line,) = table.lines([result])
    assert (line["all runs"], line["median"], line["p90"], line["worst"]) == ("1.0004", "0.75", "1", "1")


@pytest.mark.parametrize(
    ("figure", "values", "expected"),
    [
        ("settled", range(40), 35.0),
        ("settled", [*range(36), *[math.inf] * 4], 35.0),
        ("settled", [*range(35), *[math.inf] * 5], math.inf),
        ("f_n covered", range(40), 4.0),
        ("f_n covered", [3.0], 3.0),
        ("f_n covered", [*range(39), math.nan], math.nan),
    ],
)
def test_nine_runs_of_ten_are_no_worse_than_p90(figure: str, values: Sequence[float], expected: float) -> None:
    result = run_conditions.EnvelopeResult(Condition("", ""), {figure: np.array(values, np.float64)})
    np.testing.assert_equal(result.of(Limit(figure, over="p90")), expected)


def test_estimates_that_are_not_finite_keep_no_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    limits = (Limit("f_n rms", most=1e9), Limit("f_n covered", least=0.1))
    row = Condition("steady", "", Motion(duration=3.0), limits, start=1.0)
    estimates = firmware.estimates

    def spoilt(*arguments: Any) -> firmware.Track:
        track = estimates(*arguments)
        return replace(track, value={name: np.full_like(column, np.nan) for name, column in track.value.items()})

    monkeypatch.setattr(firmware, "estimates", spoilt)
    results = run_conditions.run([row], {}, 2, lambda *_: None)
    assert not results[0].ok
    assert table.rows(results)[0]["measured"] == {"f_n rms [%]": None, "f_n covered [%]": 0.0}
    assert 'id="chart-steady"' in envelope_page.build(results, 2)


@pytest.mark.usefixtures("short")
@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--only", "mised"], ("mised", "did you mean missed?")),
        (["--only", "xyz"], ("xyz", "--list")),
        (["--seeds", "0"], ("--seeds 0", "from 1 to 1000")),
        (["--only", "reported", "--out", "/dev/null/x"], ("/dev/null/x",)),
    ],
)
def test_bad_input_is_one_line(arguments: list[str], words: tuple[str, ...], refused: Refused) -> None:
    error = refused("envelope", *arguments)
    assert all(word in error for word in words)


def test_the_list_names_every_condition(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["envelope", "--list"]) == 0
    printed = capsys.readouterr().out
    assert all(name in printed for name in (*conditions.CONDITIONS, *rules.RULES))


@pytest.mark.usefixtures("short")
@pytest.mark.parametrize(
    ("named", "ran"),
    [
        ((), ["missed", "unknown", "reported"]),
        (("rules",), ["first", "second"]),
        (("second", "reported", "rules"), ["second", "reported", "first"]),
    ],
)
def test_a_table_of_its_own_runs_where_it_is_named(tmp_path: Path, named: Sequence[str], ran: list[str]) -> None:
    only = ("--only", *named) if named else ()
    main(["envelope", *only, "--seeds", "1", "--out", str(tmp_path), "--json", str(tmp_path / "rows.json")])
    rows = json.loads((tmp_path / "rows.json").read_text(encoding="utf-8"))["rows"]
    assert [row["name"] for row in rows] == ran


def test_the_chart_of_a_flight_leaves_room_above_and_below_what_is_usual() -> None:
    """A spike, and what the bare lever does without an arm, do not squeeze it."""
    time = np.linspace(0.0, 10.0, 1001)
    value, truth = np.where(time == 5.0, 90.0, 4.0 + 0.1 * time), np.where(time < 2.0, 1.0, 4.5)
    shown = Excerpt("f_n", time, truth, value, 0.1 * value, time > 9.0).chart(2.0, [3.0]).spec()
    assert shown["layout"]["yaxis"]["range"] == pytest.approx([0.85 * 4.0, 1.15 * 5.0], rel=0.01)
    assert [trace["name"] for trace in shown["data"][-3:]] == ["truth", "estimate", "flagged"]
    nothing = np.full(len(time), np.nan)
    empty = Excerpt("f_n", time, np.empty(0), nothing, nothing, time < 0.0).chart(2.0, []).spec()
    assert empty["layout"]["yaxis"]["range"] == [0.0, 1.0]
