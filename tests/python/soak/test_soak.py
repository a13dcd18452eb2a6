"""`lever soak`: ten minutes of it; that its flights are what they say, and that what is wrong shows."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from lever_cdkf.cli.main import main
from lever_cdkf.cli.tables import Row
from lever_cdkf.firmware.library import struct_dtype
from lever_sil.scenarios import inputs
from lever_sil.soak import flights, soak, soak_page
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


def judged(relative: float, sigma: float) -> soak.Sums:
    """Return a flight in which each estimate is off by so much, and says that it is as uncertain as that; relative."""
    scenario, _ = flights.draw(1, 0)
    given = inputs.prepare(scenario)
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
