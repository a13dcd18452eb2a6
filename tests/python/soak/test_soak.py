"""`lever soak`: ten minutes of it; that its flights are what they say, and that what is wrong shows."""

from __future__ import annotations

import functools
import json
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from lever_cdkf.cli.main import main
from lever_cdkf.cli.tables import Row
from lever_cdkf.firmware.config import setting
from lever_cdkf.firmware.library import lib, struct_dtype
from lever_sil.plants.excitation import Noise
from lever_sil.plants.sensors import Scale, Spikes, Stuck
from lever_sil.scenarios import inputs
from lever_sil.scenarios.scenario import Scenario
from lever_sil.soak import flights, soak, soak_page
from python.conftest import Refused, Run
from python.report.reading import Reader, figures, unpack

Content = dict[str, Any]


@pytest.fixture(scope="module")
def summary(tmp_path_factory: pytest.TempPathFactory) -> Content:
    folder = tmp_path_factory.mktemp("soak")
    page, path = folder / "soak.html", folder / "soak.json"
    assert main(["soak", "--hours", "0.1667", "--json", str(path), "-o", str(page)]) == 0
    content: Content = json.loads(path.read_text())
    assert "Consistency by the hour" in page.read_text()
    assert "2 flights of 5 min with 6 faults: NEES " in page.read_text()
    return content


@pytest.mark.requirement("R54")
def test_ten_minutes(summary: Content) -> None:
    total = summary["total"]
    assert set(total) == {
        "hour", "flights", "flagged [%]", "NEES (expected 1)", "NIS (expected 1)", "m_p within 2 sigma [%]",
        "c_p within 2 sigma [%]", "k_p within 2 sigma [%]", "natural_frequency within 2 sigma [%]",
        "damping_ratio within 2 sigma [%]", "silent [s]", "lost", "late", "corrupt", "recoveries", "memory [MiB]",
    }  # fmt: skip
    assert abs(summary["memory_growth_mib"]) < 20.0
    assert total["memory [MiB]"] == pytest.approx(soak.memory(), rel=0.5)
    assert total["flights"] == 2
    assert sum(summary["faults"].values()) == 6
    assert summary["troubles"] == []
    assert 0.2 < total["NEES (expected 1)"] < 3.0
    assert total["NIS (expected 1)"] == pytest.approx(1.0, abs=0.05)
    assert total["natural_frequency within 2 sigma [%]"] > 80.0
    assert total["recoveries"] == 0
    (hour,) = summary["hours"]
    assert hour | {"hour": "all"} == total, "a part of an hour is all there is"


def test_flights_differ_and_repeat() -> None:
    first, again, other = (flights.draw(1, number)[0] for number in (3, 3, 4))
    columns = [inputs.prepare(scenario).truth.at(slice(None, None, 5000)) for scenario in (first, again, other)]
    assert (columns[0].parameters["k_p"] == columns[1].parameters["k_p"]).all()
    assert not (columns[0].parameters["k_p"] == columns[2].parameters["k_p"]).all()
    drawn = {fault for number in range(40) for fault in flights.draw(1, number)[1]}
    assert drawn == set(flights.FAULTS)


Spoil = Callable[[Any], None]


@functools.cache
def first_flight() -> tuple[Scenario, inputs.Inputs]:
    scenario, _ = flights.draw(1, 0)
    return scenario, inputs.prepare(scenario)


def judged(
    relative: float, sigma: float, of_health: Spoil | None = None, of_estimates: Spoil | None = None
) -> soak.Sums:
    """Return a flight in which each estimate is off by so much, and says that it is as uncertain as that; relative."""
    scenario, given = first_flight()
    time, truth = given.time[::20], given.truth.at(slice(None, None, 20))
    estimates = np.zeros(len(time), struct_dtype("lever_estimate_t"))
    healths = np.zeros(len(time), struct_dtype("lever_health_t"))
    healths["mode"] = 2
    estimates["nis"], estimates["nis_size"] = 2.0, 2
    for index, name in enumerate(soak.PARAMETERS):
        estimates["parameter"][:, index] = truth.parameters[name] * np.exp(relative)
        estimates["parameter_sigma"][:, index] = sigma * estimates["parameter"][:, index]
    for name in ("natural_frequency", "damping_ratio"):
        estimates[name] = getattr(truth.dynamics, name) * np.exp(relative)
        estimates[f"{name}_sigma"] = sigma * estimates[name]
    for spoil, rows in ((of_health, healths), (of_estimates, estimates)):
        if spoil is not None:
            spoil(rows)
    return soak.judge(scenario, time, truth, estimates, healths)


def test_what_is_wrong_shows() -> None:
    right = judged(0.1, 0.1).row()
    assert right["NEES (expected 1)"] == pytest.approx(1.0, rel=1e-4)
    assert right["k_p within 2 sigma [%]"] == 100.0
    assert right["silent [s]"] == 0.0
    wrong = judged(0.1, 0.02)
    assert wrong.row()["NEES (expected 1)"] == pytest.approx(25.0, rel=1e-3)
    assert wrong.row()["k_p within 2 sigma [%]"] == 0.0
    assert wrong.silent_s == pytest.approx(wrong.unflagged * 0.02)
    part = soak.Part(soak.Sums(not_finite=3, in_fault=50), 130.0)
    troubles = soak.SoakResult([part], 100.0, Counter()).troubles()
    assert troubles == [
        "3 estimates were not finite",
        "the estimator was in fault for 1 s",
        "memory grew by 30 MiB",
    ]


def test_a_page_that_cannot_be_written_is_told_before_the_flights(
    refused: Refused, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(soak, "run", lambda *_: pytest.fail("flown"))
    assert "/dev/null/x" in refused("soak", "-o", "/dev/null/x")


def test_flights_are_apart_by_more_than_any_gap_that_is_bridged() -> None:
    assert setting("gap_limit").greatest < flights.AT_REST
    assert flights.AT_REST * 50 < flights.DURATION


def test_sums_of_flights_add_up() -> None:
    one, two = judged(0.1, 0.1), judged(0.1, 0.02)
    for part, recoveries in ((one, 1), (two, 2)):
        part.seconds, part.not_finite, part.in_fault = flights.DURATION, 3, 4
        part.counts.update({"lost": 10, "late": 5, "corrupt": 7, "recoveries": recoveries})
    total = soak.SoakResult([soak.Part(one, 1.0), soak.Part(two, 1.0)], 1.0, Counter()).total
    assert (total.seconds, total.looks, total.judged) == (600.0, one.looks + two.looks, one.judged + two.judged)
    assert (total.not_finite, total.in_fault, total.unflagged) == (6, 8, one.unflagged + two.unflagged)
    row = total.row()
    assert row["flights"] == 2
    assert {name: row[name] for name in ("lost", "late", "corrupt", "recoveries")} == {
        "lost": 20, "late": 10, "corrupt": 14, "recoveries": 3
    }  # fmt: skip
    assert row["silent [s]"] == pytest.approx(two.silent_s)
    assert row["NEES (expected 1)"] == pytest.approx(13.0, rel=1e-3)
    assert row["NIS (expected 1)"] == pytest.approx(1.0)
    assert row["c_p within 2 sigma [%]"] == pytest.approx(50.0)


def test_nothing_that_is_judged_is_no_division_by_zero() -> None:
    row = soak.Sums().row()
    assert (row["flagged [%]"], row["NEES (expected 1)"], row["k_p within 2 sigma [%]"]) == (100.0, 0.0, 0.0)


def test_what_is_flagged_or_too_early_does_not_count() -> None:
    """Estimates are right from 15 s on and off a grip; a flag in every second look leaves half of them."""
    whole = judged(0.1, 0.02)
    assert whole.judged < 300 * 50
    assert whole.judged == whole.unflagged

    def half(health: Any) -> None:
        health["faults"][::2] = lib.LEVER_FAULT_BASE

    def resting(health: Any) -> None:
        health["mode"][::2] = lib.LEVER_MODE_COAST

    def failing(health: Any) -> None:
        health["mode"][:5] = lib.LEVER_MODE_FAULT

    for spoil in (half, resting):
        part = judged(0.1, 0.02, spoil)
        assert part.judged == whole.judged
        assert part.unflagged == pytest.approx(part.judged / 2, abs=20)
        assert part.row()["flagged [%]"] == pytest.approx(50.0, abs=0.2)
        assert part.silent_s == 0.0, "wrong for a fiftieth of a second at a time"
    assert judged(0.1, 0.1, failing).in_fault == 5
    assert whole.in_fault == whole.not_finite == 0


def test_estimates_that_are_no_numbers_are_counted() -> None:
    def spoil(estimates: Any) -> None:
        estimates["parameter"][3:5, 1] = np.nan
        estimates["parameter_sigma"][7, 2] = np.inf

    assert judged(0.1, 0.1, of_estimates=spoil).not_finite == 3


def test_memory_is_told_by_the_hour_and_counted_from_the_fourth_flight(monkeypatch: pytest.MonkeyPatch) -> None:
    """Thirteen flights: twelve to the hour."""
    taken = iter(range(100, 200))
    monkeypatch.setattr(soak, "_fly", lambda *_: soak.Sums(seconds=flights.DURATION))
    monkeypatch.setattr(soak, "memory", lambda: float(next(taken)))
    seen: list[tuple[int, int]] = []
    result = soak.run(13.0 / 12.0, 1, lambda done, of: seen.append((done, of)))
    assert [(part.sums.row()["flights"], part.memory) for part in result.parts] == [(12, 101.0), (1, 102.0)]
    assert (result.settled_memory, result.growth) == (100.0, 2.0)
    assert seen == [(done, 13) for done in range(1, 14)]
    assert sum(result.faults.values()) == 39
    assert len(soak.run(0.001, 1, lambda *_: None).parts) == 1


@pytest.mark.parametrize(("growth", "troubles"), [(20.0, []), (20.5, ["memory grew by 20 MiB"])])
def test_memory_may_grow_by_20_mib(growth: float, troubles: list[str]) -> None:
    assert soak.SoakResult([soak.Part(soak.Sums(), 100.0 + growth)], 100.0, Counter()).troubles() == troubles


DRAWN = [flights.draw(1, number) for number in range(60)]


def test_pilots_cabins_and_sensors_are_drawn_from_their_ranges() -> None:
    grips, hands_off, undithered = [], 0, 0
    for number, (scenario, faults) in enumerate(DRAWN):
        assert (scenario.title, scenario.duration, scenario.converged_after) == (f"Flight {number}", 300.0, 15.0)
        assert len(faults) == 3
        (base,) = scenario.base
        assert isinstance(base, Noise)
        assert 0.05 * 9.80665 <= base.rms <= 0.15 * 9.80665
        assert (base.low, base.high) == (1.0, 10.0)
        undithered += not scenario.torque
        pilot: Any = scenario.pilot
        hands_off += bool(pilot.hands_off)
        assert all(1.0 <= gone.end - gone.start <= 8.0 for gone in pilot.hands_off)
        times = getattr(pilot.k_p, "at", ())
        assert times == getattr(pilot.c_p, "at", ())
        assert all(30.0 <= at < 275.0 for at in (*times, *(gone.start for gone in pilot.hands_off)))
        grips.append(len(times))
        if number < 6:
            held = inputs.prepare(scenario).truth.at(slice(None, None, 5000)).parameters
            for name, least, most in (("m_p", 1.5, 4.5), ("c_p", 25.0, 90.0), ("k_p", 800.0, 3200.0)):
                assert 0.99 * least <= np.nanmin(held[name]) <= np.nanmax(held[name]) <= 1.01 * most
        sensors = scenario.sensors
        assert (sensors.theta.noise, sensors.theta_dot.noise, sensors.z_ddot.noise) == (1e-3, 1e-2, 0.01)
        assert abs(sensors.tau_m.gain_error) <= 0.2
        assert abs(sensors.z_ddot.gain_error) <= 0.06
    assert max(grips) <= 4
    assert 1.4 < np.mean(grips) < 2.4
    assert 5 <= hands_off <= 25
    assert 5 <= undithered <= 25
    gains = np.array([[each.sensors.tau_m.gain_error, each.sensors.z_ddot.gain_error] for each, _ in DRAWN])
    np.testing.assert_allclose(gains.std(axis=0), (0.07, 0.02), rtol=0.35)


FAULTS: dict[str, tuple[str, Any, tuple[float, float]]] = {
    "theta stuck": ("theta", Stuck(), (0.5, 4.0)),
    "theta_dot stuck": ("theta_dot", Stuck(), (0.5, 4.0)),
    "z_ddot stuck": ("z_ddot", Stuck(), (0.5, 4.0)),
    "z_ddot zero": ("z_ddot", Scale(factor=0.0), (0.5, 4.0)),
    "z_ddot reversed": ("z_ddot", Scale(factor=-1.0), (0.5, 4.0)),
    "theta spikes": ("theta", Spikes(share=0.01, size=0.3), (2.0, 10.0)),
    "theta_dot spikes": ("theta_dot", Spikes(share=0.01, size=3.0), (2.0, 10.0)),
}
MISSING: dict[str, tuple[str, float, float, tuple[float, float]]] = {
    "theta invalid": ("theta", 1.0, 1e-3, (0.5, 4.0)),
    "theta_dot invalid": ("theta_dot", 1.0, 1e-3, (0.5, 4.0)),
    "z_ddot invalid": ("z_ddot", 1.0, 1e-3, (0.1, 2.0)),
    "lever frames lost": ("lever_frame", 0.05, 5e-3, (2.0, 20.0)),
    "base frames lost": ("base_frame", 0.02, 3e-3, (2.0, 20.0)),
    "all frames lost": ("base_frame", 1.0, 1e-3, (0.03, 1.5)),
}


def test_each_fault_does_what_its_name_says_for_as_long_as_it_may() -> None:
    assert flights.FAULTS.keys() == FAULTS.keys() | MISSING.keys()
    seen: dict[str, list[float]] = {}
    for scenario, names in DRAWN:
        sensors = scenario.sensors
        failing = [(name, each) for name in ("theta", "theta_dot", "z_ddot") for each in getattr(sensors, name).fault]
        assert len(failing) + len(sensors.dropout) == 3
        for name in names:
            if name in FAULTS:
                sensor, kind, _ = FAULTS[name]
                fits = [
                    each
                    for of, each in failing
                    if of == sensor and each == replace(kind, start=each.start, end=each.end)
                ]
            else:
                what, share, burst, _ = MISSING[name]
                fits = [
                    each
                    for each in sensors.dropout
                    if each.what == what and np.allclose((each.share, each.burst), (share, burst))
                ]
            assert fits, name
            seen.setdefault(name, []).extend(each.end - each.start for each in fits)
            assert all(30.0 <= each.start < 275.0 for each in fits)
    for name, lengths in seen.items():
        least, most = (FAULTS | MISSING)[name][-1]
        assert least <= min(lengths) < 0.5 * (least + most) < max(lengths) <= most, name


def test_wrong_hours_and_seeds_are_one_line(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    for hours in ("0", "-1", "nan", "1e9"):
        assert main(["soak", f"--hours={hours}"]) == 2
        assert "above 0, and at most 1000" in capsys.readouterr().err
    assert main(["soak", "--seed=-1"]) == 2
    assert "argument --seed: -1 is not from 0" in capsys.readouterr().err


@pytest.mark.parametrize("troubles", [False, True])
def test_the_page_shows_each_hour(troubles: bool) -> None:
    hours = [judged(0.1, 0.1), judged(0.1, 0.05)]
    for each in hours:
        each.seconds = flights.DURATION
    memory = (100.0, 130.0 if troubles else 101.0)
    result = soak.SoakResult(list(map(soak.Part, hours, memory)), 100.0, Counter())
    rows: list[Row] = [part.sums.row() for part in result.parts]
    page = Reader(soak_page.build(result, rows, "So it went."))
    assert "Lever CDKF: 10 minutes without a reset" in "".join(page.text)
    assert ("p", {"class": f"verdict {'bad' if troubles else 'good'}"}) in page.tags
    chart = figures(page)["chart"]
    shown = {trace["name"]: (trace["yaxis"], unpack(trace["y"]).tolist()) for trace in chart["data"]}
    assert all(unpack(trace["x"]).tolist() == [1.0, 2.0] for trace in chart["data"])
    assert shown["NEES"] == ("y", pytest.approx([1.0, 4.0], rel=1e-3))
    assert shown["NIS"] == ("y", pytest.approx([1.0, 1.0], rel=1e-3))
    for name in soak.QUANTITIES:
        held = [row[f"{name} within 2 sigma [%]"] for row in rows]
        assert shown[f"{name} within 2σ"] == ("y2", pytest.approx(held)), name
    assert shown["memory"] == ("y3", list(memory))
    assert len({trace["line"]["color"] for trace in chart["data"]}) == len(chart["data"])
    assert {trace["mode"] for trace in chart["data"]} == {"lines+markers"}
    assert chart["layout"]["xaxis"]["range"] == [0.5, 2.5]
    assert [(shape["y0"], shape["y1"]) for shape in chart["layout"]["shapes"]] == [(1.0, 1.0)]
    assert not chart["over_time"]


@pytest.mark.parametrize("troubled", [False, True])
def test_the_command_says_and_writes_what_the_hours_came_to(
    troubled: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, lever: Run
) -> None:
    """Two hours; the memory is that of the end."""
    hours = [replace(judged(0.1, 0.1), seconds=flights.DURATION), replace(judged(0.1, 0.02), seconds=flights.DURATION)]
    for each in hours:
        each.counts.update({"recoveries": 2, "lost": 3})
        each.not_finite = int(troubled)
    parts = [soak.Part(hours[0], 101.0), soak.Part(hours[1], 102.5)]
    made = soak.SoakResult(parts, 100.0, Counter({"theta stuck": 4, "base frames lost": 2}))
    asked: list[tuple[float, int]] = []

    def run(length: float, seed: int, _show: Any) -> soak.SoakResult:
        asked.append((length, seed))
        return made

    monkeypatch.setattr(soak, "run", run)
    page, file = tmp_path / "soak.html", tmp_path / "soak.json"
    status, printed, error = lever("soak", "--hours", "0.5", "--seed", "7", "-o", page, "--json", file)
    assert asked == [(0.5, 7)]
    assert status == int(troubled)
    assert error == ("lever: soak: 2 estimates were not finite\n" if troubled else "")
    words = " ".join(printed.split())
    silent = f"{hours[1].silent_s:.0f}"
    assert (
        f"2 flights of 5 min with 6 faults: NEES 13.00 (expected 1), silent errors for {silent} s, 4 restarts of the "
        "filter, memory +2.5 MiB."
    ) in words
    assert f"Written to {tmp_path}: soak.html" in words
    content = json.loads(file.read_text())
    assert content.keys() == {"hours", "total", "memory_growth_mib", "faults", "troubles", "provenance"}
    assert [(hour["hour"], hour["memory [MiB]"]) for hour in content["hours"]] == [(1, 101.0), (2, 102.5)]
    assert (content["total"]["hour"], content["total"]["memory [MiB]"], content["total"]["lost"]) == ("all", 102.5, 6)
    assert content["memory_growth_mib"] == 2.5
    assert content["faults"] == {"base frames lost": 2, "theta stuck": 4}
    assert content["troubles"] == (["2 estimates were not finite"] if troubled else [])
    reader = Reader(page.read_text())
    assert "silent errors for" in "".join(reader.text)
    assert {"hours", "table"} <= {attributes["id"] for _, attributes in reader.tags if attributes.get("id")}


@pytest.mark.parametrize(
    ("seconds", "said"),
    [(300.0, "5 minutes"), (3599.0, "60 minutes"), (3600.0, "An hour"), (5400.0, "1.5 hours"), (86400.0, "A day")],
)
def test_the_page_says_for_how_long_it_flew(seconds: float, said: str) -> None:
    result = soak.SoakResult([soak.Part(soak.Sums(seconds=seconds), 1.0)], 1.0, Counter())
    page = Reader(soak_page.build(result, [part.sums.row() for part in result.parts], ""))
    assert f"{said} without a reset" in "".join(page.text)


@pytest.mark.parametrize(("count", "each"), [(12, 1), (13, None)])
def test_few_hours_are_each_written_at_the_axis(count: int, each: int | None) -> None:
    result = soak.SoakResult([soak.Part(soak.Sums(seconds=300.0), 1.0)] * count, 1.0, Counter())
    page = Reader(soak_page.build(result, [part.sums.row() for part in result.parts], ""))
    assert figures(page)["chart"]["layout"]["xaxis"].get("dtick") == each
