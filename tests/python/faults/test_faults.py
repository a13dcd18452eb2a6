"""The fault matrix, each row with one pilot; and that its faults are what they say."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from lever_cdkf.cli.main import main
from lever_cdkf.firmware.config import Config
from lever_cdkf.firmware.library import lib
from lever_sil.batch import firmware
from lever_sil.batch.firmware import ClosedLoop
from lever_sil.batch.motions import PERIOD, STRIDE
from lever_sil.faults import bus, faults_page, judge, matrix, readings, table
from lever_sil.faults.flight import Pilot, Record
from lever_sil.faults.rows import KNOWN, MOTION, ROWS, TIME
from lever_sil.plants.sensors import Scale, Stuck
from python.conftest import Refused


class Practised(Pilot):
    """Flies once, by the defaults, what is without a fault: every row is compared with such a flight."""

    def __init__(self) -> None:
        super().__init__(MOTION, 0)
        self._plain: dict[tuple[bool, bool], Record] = {}

    def fly(
        self,
        config: Config,
        time: bus.Interval,
        on_bus: bus.Fault = bus.nothing,
        on_readings: readings.Fault = readings.nothing,
        grip: bool = False,
        frozen: bool = False,
    ) -> Record:
        if on_bus is not bus.nothing or on_readings is not readings.nothing:
            return super().fly(config, time, on_bus, on_readings, grip, frozen)
        if (grip, frozen) not in self._plain:
            self._plain[grip, frozen] = super().fly(config, time, grip=grip, frozen=frozen)
        return self._plain[grip, frozen]


@pytest.fixture(scope="module")
def pilot() -> Pilot:
    return Practised()


@pytest.fixture(scope="module")
def right(pilot: Pilot) -> Record:
    """Without a fault."""
    return pilot.fly(Config(), TIME)


@pytest.mark.requirement("R12", "R19", "R22", "R30", "R33", "R35", "R36")
@pytest.mark.parametrize("name", ROWS)
@pytest.mark.requirement("S5")
def test_a_fault_is_met_as_demanded(name: str, pilot: Pilot) -> None:
    """Or it is known not to be, with the reason. How often estimates are right is a matter of many flights."""
    (verdict,) = matrix.flights([ROWS[name]], pilot)
    assert not verdict.broken or name in KNOWN, (verdict.broken, verdict.measured)


def test_without_a_fault_it_is_the_loop_by_structs(right: Record) -> None:
    """The same pilot, dither and noise, but for the rounding of the frames."""
    _, track = firmware.closed_loop(Config(), MOTION, [0], ClosedLoop(lost=0.0), lambda: None)
    late = track.time >= TIME[0]
    own = right.estimate["natural_frequency"][late]
    np.testing.assert_allclose(own, track.value["f_n"][late, 0], rtol=2e-3)
    assert right.results[lib.LEVER_FRAME_REFUSED] == right.unanswered == 0


@pytest.mark.requirement("R18")
@pytest.mark.parametrize("message", ["LEVER_SAMPLE", "BASE_SAMPLE"])
def test_every_flipped_bit_is_counted(message: str, pilot: Pilot) -> None:
    record = pilot.fly(Config(), TIME, bus.flipped(message, 5))
    assert record.health["corrupt"][-1] == 1000
    assert record.results[lib.LEVER_FRAME_REFUSED] == 1000


def test_frames_arrive_as_the_fault_says() -> None:
    def arrive(fault: bus.Fault) -> list[tuple[int, int, int]]:
        sent = bus.Bus(6, 1e-3, False, 0.3, np.random.default_rng(1))
        fault(sent, (2e-3, 4e-3))
        frames = sent.delivered()
        return [(int(each["at"]), int(each["of"]), int(each["id"]) & 15) for each in frames if each["id"] < 0x120]

    usual = [(i, i, message) for i in range(6) for message in (0, 1)]
    assert arrive(bus.nothing) == usual
    assert arrive(bus.lost("LEVER_SAMPLE", 1.1)) == [each for each in usual if each not in ((2, 2, 0), (3, 3, 0))]
    assert arrive(bus.late("BASE_SAMPLE", 1.0))[5:9] == [(3, 3, 0), (3, 2, 1), (4, 4, 0), (4, 3, 1)]
    assert arrive(bus.repeated("LEVER_SAMPLE"))[4:7] == [(2, 2, 0), (2, 2, 0), (2, 2, 1)]
    assert arrive(bus.stale("BASE_SAMPLE"))[5:8] == [(2, 2, 1), (3, 3, 0), (3, 2, 1)]


@pytest.mark.parametrize(("usual", "expected"), [(False, []), (True, [250, 500])])
def test_other_commands_come_beside_the_usual_ones_or_instead(usual: bool, expected: list[int]) -> None:
    sent = bus.Bus(1000, 1e-3, False, 0.3, np.random.default_rng(1))
    bus.commands(bus.unknown_command, 100, usual)(sent, (0.2, 0.6))
    frames = sent.delivered()
    at = frames["at"][frames["id"] == 0x120].tolist()
    assert at == sorted([0, 200, 300, 400, 500, 750, *expected])


def test_a_flood_of_commands_comes_instead_of_the_usual_ones_in_sequence() -> None:
    """So that what the estimator refuses is refused for what it holds, and not for a counter that came twice."""
    sent = bus.Bus(1000, 1e-3, False, 0.3, np.random.default_rng(1))
    bus.flood([{}], {}, 2)(sent, (0.4, 0.6))
    frames = sent.delivered()
    commands = frames[frames["id"] == 0x120]
    assert commands["at"].tolist() == sorted([0, 250, *range(400, 600), *range(400, 600), 750])
    assert [int(data[1]) & 15 for data in commands["change"]] == [i & 15 for i in range(403)]


def test_readings_are_spoilt_as_the_fault_says() -> None:
    def spoilt(fault: readings.Fault) -> readings.Readings:
        right = readings.Readings.right(6, 1e-3, np.random.default_rng(1))
        fault(right, np.array([2, 3]))
        return right

    assert spoilt(readings.wrong(Stuck(), "theta")).of["theta"].source.tolist() == [0, 1, 1, 1, 4, 5]
    both = spoilt(readings.wrong(Scale(factor=-1.0), "tau_m", "z_ddot")).of
    assert both["tau_m"].factor.tolist() == both["z_ddot"].factor.tolist() == [1, 1, -1, -1, 1, 1]
    assert both["theta"].factor.tolist() == [1] * 6
    assert spoilt(readings.clock(lambda t: 0.0 * t)).time_us.tolist() == [0, 1000, 2000, 2000, 4000, 5000]
    assert spoilt(readings.clock_offset(1.0)).time_us.tolist()[1:3] == [1000, 1002000]


def test_without_out_no_file_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["faults", "--only", "z_ddot_sign_from_power_on", "--seeds", "1"]) == 0
    said = capsys.readouterr().out
    assert "known" in said.splitlines()[3].split()
    assert "1 faults: 1 not met as demanded (0 silent); 1 of these are known limitations." in said
    assert list(tmp_path.iterdir()) == []


def test_the_command_writes_its_rows(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "rows.json"
    only = ["--only", "theta_stuck", "foreign_load", "--seeds", "1"]
    assert main(["faults", *only, "--json", str(file), "--out", str(tmp_path)]) == 0
    content = json.loads(file.read_text(encoding="utf-8"))
    assert [row["name"] for row in content["rows"]] == ["theta_stuck", "foreign_load"]
    assert content["count"] == 2
    assert "theta_stuck" in capsys.readouterr().out
    page = (tmp_path / "faults.html").read_text(encoding="utf-8")
    assert 'id="chart-theta_stuck"' in page
    assert "2 of 2 faults are met" in page


def test_a_fault_that_is_not_met_is_named_and_explained(pilot: Pilot) -> None:
    """A demand that no firmware keeps: a flag for what cannot be seen."""
    row = replace(ROWS["clock_wraps"], requirement=judge.Requirement(("CLOCK",), 1))
    result = matrix.RowResult(row, list(matrix.flights([row], pilot)))
    assert result.broken == ["to flag"]
    assert table.unexpected([result]) == ["clock_wraps"]
    assert "<strong" in faults_page.build([result], 1)
    assert table.state(result) == table.MISSED
    known = replace(result, row=replace(row, name=next(iter(KNOWN))))
    assert table.state(known) == "known"
    assert 'class="verdict watch"' in faults_page.build([known], 1)


def spoilt(right: Record, **columns: tuple[slice, float]) -> Record:
    """With a factor, or what is no number, on a stretch of these columns of the estimates."""
    estimate = right.estimate.copy()
    for name, (where, factor) in columns.items():
        estimate[name][where] *= factor
    return replace(right, estimate=estimate)


FIRST, AFTER, LAST = slice(0, 1), slice(round(TIME[1] / PERIOD / STRIDE), None), slice(-5, None)
BROKEN: dict[str, tuple[judge.Requirement, Callable[[Record], Record]]] = {
    "not finite": (judge.Requirement(), lambda right: spoilt(right, theta=(FIRST, math.nan))),
    "unanswered": (judge.Requirement(), lambda right: replace(right, unanswered=1)),
    "torque": (
        judge.Requirement(),
        lambda right: replace(right, asked=2.001 * (right.asked == right.asked.max())),
    ),
    "torque rms": (judge.Requirement(), lambda right: replace(right, asked=np.full_like(right.asked, 1.001))),
    "torque left": (judge.Requirement(torque_ends=0.06), lambda right: right),
    "estimates changed": (judge.Requirement(unaffected=True), lambda right: spoilt(right, theta=(LAST, 1.001))),
    "to flag after": (judge.Requirement(after=("CLOCK",)), lambda right: right),
    "mode run": (judge.Requirement(mode=("init",)), lambda right: right),
    "silent": (judge.Requirement(), lambda right: spoilt(right, natural_frequency=(AFTER, 1.5))),
    "error after": (judge.Requirement(), lambda right: spoilt(right, natural_frequency=(LAST, 3.0))),
}


@pytest.mark.parametrize("what", BROKEN)
def test_a_demand_that_is_not_kept_is_named(what: str, right: Record, pilot: Pilot) -> None:
    requirement, spoil = BROKEN[what]
    assert judge.judge(judge.Requirement(unaffected=True), right, right, pilot.truth, TIME).broken == []
    broken = judge.judge(requirement, spoil(right), right, pilot.truth, TIME).broken
    assert broken[0] == what
    assert set(broken) <= {what, "error after"}


# --- what is measured, at the edges of what is allowed ---------------------------------------------------------------

END = round(TIME[1] / PERIOD)
"""The first sample after the fault."""


def measured(
    record: Record, right: Record, pilot: Pilot, requirement: judge.Requirement | None = None
) -> judge.Verdict:
    return judge.judge(requirement or judge.Requirement(), record, right, pilot.truth, TIME)


def known(right: Record, pilot: Pilot) -> Record:
    """Return a record whose estimates are the truth, a tenth uncertain, without any flag."""
    estimate, health, of = right.estimate.copy(), right.health.copy(), pilot.truth
    for name, truth in (("natural_frequency", of["f_n"]), ("damping_ratio", of["zeta"])):
        estimate[name], estimate[f"{name}_sigma"] = truth, 0.1 * np.abs(truth)
    for i, name in enumerate(("m_p", "c_p", "k_p")):
        estimate["parameter"][:, i], estimate["parameter_sigma"][:, i] = of[name], 0.1 * of[name]
    health["faults"], health["mode"] = 0, lib.LEVER_MODE_RUN
    return replace(right, estimate=estimate, health=health)


def flagged(record: Record, *stretches: tuple[int, int]) -> Record:
    """Return it with a fault in these stretches of samples after the end of the fault."""
    health = record.health.copy()
    for first, last in stretches:
        health["faults"][END + first : END + last] = lib.LEVER_FAULT_THETA
    return replace(record, health=health)


def test_all_is_right_where_nothing_is_wrong(right: Record, pilot: Pilot) -> None:
    verdict = measured(known(right, pilot), right, pilot)
    assert verdict.broken == []
    named = ("not finite", "unanswered", "back", "silent", "error after")
    assert {name: verdict.measured[name] for name in named} == pytest.approx(dict.fromkeys(named, 0.0), abs=1e-4)
    assert verdict.measured["covered"] == 100.0


def test_the_firmware_is_back_when_it_has_been_calm_for_half_a_second(right: Record, pilot: Pilot) -> None:
    """A pause of 0.49 s between two flags is none, one of half a second is."""
    record = known(right, pilot)
    for pause, back in ((490, 0.89), (500, 0.3)):
        spoilt_record = flagged(record, (0, 300), (300 + pause, 400 + pause))
        assert measured(spoilt_record, right, pilot).measured["back"] == pytest.approx(back)
    assert measured(flagged(record, (0, 2000)), right, pilot).broken == []
    assert measured(flagged(record, (0, 2001)), right, pilot).broken == ["back"]
    other = record.health.copy()
    other["faults"][END : END + 3000] = lib.LEVER_FAULT_EXCITATION
    assert measured(replace(record, health=other), right, pilot).measured["back"] == 0.0, "it learns"
    other["mode"][END : END + 700] = lib.LEVER_MODE_COAST
    assert measured(replace(record, health=other), right, pilot).measured["back"] == pytest.approx(0.7)


def off(record: Record, sigmas: float, first: int, last: int) -> Record:
    """Return it with k_p off by so many standard deviations in a stretch of samples after the end of the fault."""
    estimate = record.estimate.copy()
    where = slice((END + first) // STRIDE, (END + last) // STRIDE)
    estimate["parameter"][where, 2] += sigmas * estimate["parameter_sigma"][where, 2]
    return replace(record, estimate=estimate)


def test_three_sigma_for_a_second_without_a_flag_is_silent(right: Record, pilot: Pilot) -> None:
    record = known(right, pilot)
    for sigmas, length, silent in ((3.1, 1000, 1.0), (-3.1, 990, 0.99), (2.9, 5000, 0.0)):
        verdict = measured(off(record, sigmas, 0, length), right, pilot)
        assert verdict.measured["silent"] == pytest.approx(silent)
        assert verdict.excerpt is not None
    assert measured(off(record, 3.1, 0, 1010), right, pilot).broken == ["silent"]
    assert measured(off(record, 3.1, 0, 1000), right, pilot).broken == []
    shown = measured(off(record, 3.1, 0, 1000), right, pilot)
    assert shown.excerpt is not None
    assert shown.excerpt.quantity == "k_p"
    assert shown.measured["covered"] == pytest.approx(100.0 * (1.0 - 1.0 / 25.0), abs=0.01)
    both = flagged(off(record, 3.1, 0, 3000), (0, 1500), (2000, 3000))
    assert measured(both, right, pilot).measured["silent"] == pytest.approx(0.5)
    before = off(record, 9.0, round(-12.0 / PERIOD), round(-10.1 / PERIOD))
    assert measured(before, right, pilot).measured["silent"] == 0.0, "before the fault it is not judged"


def test_silence_of_twenty_samples_is_a_flag(right: Record, pilot: Pilot) -> None:
    record = known(right, pilot)
    health = record.health.copy()
    health["samples"] = np.arange(1, len(health) + 1)
    health["samples"][END + 1 : END + 101] = health["samples"][END]
    silent = judge.is_flagged(replace(record, health=health))
    assert np.flatnonzero(silent).tolist() == list(range(END + 20, END + 101))


@pytest.mark.parametrize(("percent", "broken"), [(2.99, []), (3.01, ["error after"])])
def test_the_natural_frequency_is_known_to_3_percent_in_the_last_five_seconds(
    percent: float, broken: list[str], right: Record, pilot: Pilot
) -> None:
    record = known(right, pilot)
    estimate = record.estimate.copy()
    estimate["natural_frequency"][-round(5.0 / PERIOD / STRIDE) :] *= 1.0 + 0.01 * percent
    estimate["natural_frequency"][: -round(5.0 / PERIOD / STRIDE)] *= 1.1
    verdict = measured(replace(record, estimate=estimate), right, pilot)
    assert verdict.broken == broken
    assert verdict.measured["error after"] == pytest.approx(percent, rel=1e-3)


def test_flags_are_counted_from_the_begin_of_the_fault_and_after_its_end(right: Record, pilot: Pilot) -> None:
    begin, record = round(TIME[0] / PERIOD), known(right, pilot)

    def shown(first: int, requirement: judge.Requirement) -> judge.Verdict:
        health = record.health.copy()
        health["faults"][first] = lib.LEVER_FAULT_GAP
        return measured(replace(record, health=health), right, pilot, requirement)

    for sample, figure in ((begin, 1.0), (begin + 3, 4.0)):
        verdict = shown(sample, judge.Requirement(("BASE", "GAP"), 3))
        assert verdict.measured["to flag"] == figure
        assert verdict.broken == (["to flag"] if figure > 3.0 else [])
    assert shown(begin - 1, judge.Requirement(("GAP",), 3)).measured["to flag"] == math.inf
    for sample, figure in ((END, 1.0), (END + 1, 2.0), (END + 2, 3.0), (END + 3, math.inf)):
        verdict = shown(sample, judge.Requirement(after=("GAP",)))
        assert verdict.measured["to flag after"] == figure
        assert ("to flag after" in verdict.broken) == (figure > 2.0)


@pytest.mark.parametrize(
    ("requirement", "words"),
    [
        (judge.Requirement(unaffected=True), "not a bit changes"),
        (judge.Requirement(("CLOCK",)), "CLOCK within 1 sample, mode run"),
        (
            judge.Requirement(("CLOCK", "BASE"), 3, ("LEVER",), mode=("init", "run"), torque_ends=0.06),
            "CLOCK or BASE within 3 samples, LEVER at its end, mode init or run, no torque after 0.06 s",
        ),
    ],
)
def test_what_a_row_demands_is_said(requirement: judge.Requirement, words: str) -> None:
    assert table.demands(requirement) == words


def test_bad_input_is_one_line(refused: Refused) -> None:
    assert "did you mean theta_stuck?" in refused("faults", "--only", "theta_stucl")
    assert "from 1 to 1000" in refused("faults", "--seeds", "0")
