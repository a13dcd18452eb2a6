"""The table and the charts of `lever compare`, column by column and mark by mark."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from lever_cdkf.report.figure import SERIES, Figure
from lever_sil.study.baselines import BASELINES
from lever_sil.study.compare import charts, compare_page, evaluation, table
from lever_sil.study.compare.cases import Plan
from lever_sil.study.compare.run_cases import Results
from python.report.reading import Reader, figures, unpack
from python.study.test_compare import CASE, everything, fives, made_up, points, row
from python.study.test_drawn import known

NAMES = ("m_p", "c_p", "k_p", "natural_frequency", "damping_ratio")


def test_a_line_of_the_table_has_every_column_of_its_row() -> None:
    figures_of = {
        "rms": (0.01, 0.02, 0.03, 0.04, 0.05), "linearised": (1.1, 1.2, 1.3, 1.4, 1.5),
        "bound": (2.1, 2.2, 2.3, 2.4, 2.5), "against": (0.1, 0.2, 0.3, 0.4, 0.5),
    }  # fmt: skip
    one = row(
        "joint", 0.1, **figures_of, linearised_error=(0.01, 0.02, 0.036, 0.02, 0.01), nees=3.1, nees_low=2.5,
        nees_high=3.6, nees_inside=0.91, nis=2.2, nis_inside=0.92, settled_median=0.61, settled_worst=7.31,
        microseconds=12.34, relative_time=1.51, asked=20, runs=19, failures=2,
    )  # fmt: skip
    ((line,),) = table.tables([one], []).values()
    titles = {"rms": "rms [%]", "linearised": "÷ linearised", "bound": "÷ Cramér-Rao", "against": "÷ reference"}
    scale = {"rms": 100.0}
    expected: dict[str, Any] = {"estimator": "joint", "runs": 19, "failed": 2}
    for key, title in titles.items():
        values = zip(NAMES, figures_of[key], strict=True)
        expected |= {f"{name} {title}": pytest.approx(scale.get(key, 1.0) * value) for name, value in values}
    expected |= {
        "± of these": 0.036, "NEES (expected 3)": 3.1, "95 % band": "2.50-3.60", "NEES inside [1]": 0.91,
        "NIS (expected 2)": 2.2, "NIS inside [1]": 0.92, "settled, median [s]": 0.61, "settled, worst [s]": 7.31,
        "step [µs]": 12.3, "÷ dual": 1.51,
    }  # fmt: skip
    assert line == expected


def test_columns_without_a_figure_are_left_out() -> None:
    (lines,) = table.tables([row("joint", 0.1), row("rls", 0.2, nis=2.0)], []).values()
    assert {"nis" in name.lower() for name in lines[0]} == {True, False}
    assert not any("settled" in name or "÷ reference" in name for line in lines for name in line)
    assert lines[0]["NIS (expected 2)"] is None


# --- charts ----------------------------------------------------------------------------------------------------------


def stepped() -> Results:
    """Return three runs of two estimators: settled after 1 and 3 s, or never; the error jumps by 10, 20 or 30 %."""
    time = np.arange(0.05, 45.0, 0.05)
    outcomes = {}
    for name, sign in (("dual_shipped", 1.0), ("joint_shipped", 0.6), ("rls", -1.0)):
        errors = np.zeros((3, len(time), 5))
        for run, seconds in enumerate((1.0, 3.0, 99.0)):
            errors[run, (time > 25.0) & (time < 25.0 + seconds), 3] = sign * 0.1 * (run + 1)
        outcomes["step_up", name] = made_up(errors, time)
    return Results(Plan(3), outcomes, {})


def drawn(figure: Figure | None) -> dict[str, Any]:
    """Return a chart as the page has it, which plotly knows."""
    from plotly import graph_objects

    assert figure is not None
    spec = figure.spec()
    graph_objects.Figure({"data": known(spec["data"]), "layout": known(spec["layout"])})
    assert not spec["over_time"]
    return spec


def test_settling_has_a_dot_for_each_run_hollow_at_the_end_where_it_never_does() -> None:
    spec = drawn(charts.settling(stepped(), "step_up"))
    traces = [(unpack(trace["x"]), unpack(trace["y"]), trace) for trace in spec["data"]]
    assert spec["layout"]["yaxis"]["ticktext"] == ["dual_shipped", "joint_shipped", "rls"]
    assert spec["layout"]["yaxis"]["tickvals"] == [0, 1, 2]
    assert spec["layout"]["yaxis"]["range"] == [2.5, -0.5]
    assert spec["layout"]["xaxis"]["title"]["text"] == "time after the step [s]"
    assert not spec["layout"]["showlegend"]
    for lane in range(3):
        filled, hollow = traces[2 * lane : 2 * lane + 2]
        assert (filled[2]["marker"]["symbol"], hollow[2]["marker"]["symbol"]) == ("circle", "circle-open")
        np.testing.assert_allclose(filled[0], (1.0, 3.0), atol=0.051)
        np.testing.assert_allclose(hollow[0], 19.95, atol=0.051)
        np.testing.assert_allclose([*filled[1], *hollow[1]], (lane - 0.25, lane, lane + 0.25), atol=1e-6)
    assert charts.settling(Results(Plan(3), {}, {}), "step_up") is None
    assert charts.settling(stepped(), CASE) is None


def test_following_shows_the_median_and_the_middle_half_of_the_first_of_ours() -> None:
    spec = drawn(charts.following(stepped(), "step_up"))
    names = [trace.get("name") for trace in spec["data"]]
    assert names[-1] == "rls"
    assert "joint_shipped" not in names
    by_name = {trace["name"]: trace for trace in spec["data"] if trace.get("name")}
    time = unpack(by_name["rls"]["x"])
    assert (time[0], time[-1]) == pytest.approx((-1.95, 14.95), abs=0.051)
    after = (time > 0.01) & (time < 0.9)
    np.testing.assert_allclose(unpack(by_name["rls"]["y"])[after], -20.0, rtol=1e-5)
    np.testing.assert_allclose(unpack(by_name["dual_shipped"]["y"])[after], 20.0, rtol=1e-5)
    assert not unpack(by_name["rls"]["y"])[time < 0.0].any()
    around = [trace for trace in spec["data"] if trace.get("name") not in ("rls", "dual_shipped")]
    edges = sorted(float(unpack(trace["y"])[after].mean()) for trace in around)
    assert edges == pytest.approx([15.0, 25.0])
    assert any(name and "dual_shipped, middle half of runs" in name for name in names)
    layout = spec["layout"]
    assert (layout["yaxis"]["range"], layout["height"]) == ([-25, 35], 380)
    assert layout["yaxis"]["title"]["text"] == "error of f_n [%]"
    assert sorted(shape["y0"] for shape in layout["shapes"]) == [-5.0, 5.0]
    assert charts.following(stepped(), "steady") is None


def test_lanes_are_on_a_logarithmic_axis_and_as_high_as_their_names_and_series() -> None:
    rows = everything()
    noise = drawn(charts.wrong_noise(rows, "wrong_noise_fixed"))
    assert noise["layout"]["xaxis"]["title"]["text"] == "rms error ÷ that of the filter told the truth"
    assert noise["layout"]["showlegend"]
    assert noise["layout"]["height"] == round(22 * 2 * (1.0 + 0.3 * 4)) + 70 + 100
    walks = drawn(
        charts.linearised([row(name, 0.1, linearised=fives(1.0)) for name in ("joint", "rls")], "lever", "fixed")
    )
    assert walks["layout"]["xaxis"]["type"] == "log"
    assert walks["layout"]["height"] == 2 * 22 + 70 + 20
    assert not walks["layout"]["showlegend"], "of one case"
    assert walks["layout"]["xaxis"]["title"]["text"] == "error ÷ Kalman filter linearised at the truth"
    mark = walks["layout"]["shapes"][0]
    assert (mark["x0"], mark["x1"], mark["y0"], mark["y1"], mark["yref"]) == (1.0, 1.0, 0, 1, "paper")
    legend = [trace for trace in noise["data"] if np.isnan(unpack(trace["x"])).all()]
    assert [trace["name"] for trace in legend] == list(NAMES)
    assert all(trace.get("showlegend", True) for trace in legend)
    assert not any(trace["showlegend"] for trace in points(noise["data"]))
    assert len({trace["marker"]["symbol"] for trace in points(noise["data"])}) == 5
    edges = [unpack(trace["y"])[0] for trace in points(noise["data"])]
    np.testing.assert_allclose(edges, [-0.24, -0.12, 0.0, 0.12, 0.24], atol=1e-6)


def test_figures_that_are_not_known_are_not_averaged() -> None:
    known_in_part = (2.0, math.nan, 8.0, 0.0, math.inf)
    spec = drawn(charts.linearised([row("joint", 0.1, linearised=known_in_part)], "lever", "fixed"))
    assert unpack(points(spec["data"])[0]["x"]).tolist() == [4.0]
    nothing = (math.nan,) * 5
    assert charts.linearised([row("joint", 0.1, linearised=nothing)], "lever", "fixed") is None
    assert charts.linearised([row("joint", 0.1, linearised=fives(1.0))], "lever", "trim") is None
    assert charts.wrong_noise([row("joint", 0.1)], CASE) is None


def test_each_estimator_has_a_colour_of_the_page() -> None:
    assert charts.COLOURS.keys() == {"dual", "joint", *BASELINES}
    assert set(charts.COLOURS.values()) <= set(SERIES)
    assert charts.COLOURS["dual"] != charts.COLOURS["joint"]
    spec = drawn(charts.settling(stepped(), "step_up"))
    colours = [trace["marker"]["color"] for trace in spec["data"][::2]]
    assert colours == [f"@{charts.COLOURS[name]}" for name in ("dual", "joint", "rls")]


def test_two_estimators_are_enough_to_be_compared_and_one_is_not() -> None:
    time = np.arange(1.0, 61.0)
    errors = 0.1 * np.random.default_rng(1).standard_normal((8, 60, 5))
    outcomes = {(CASE, "dual"): made_up(errors, time), (CASE, "joint"): made_up(1.5 * errors, time)}
    for names, differ in ((("dual", "joint"), {(CASE, "joint")}), (("dual",), set())):
        results = Results(Plan(8), {(CASE, name): outcomes[CASE, name] for name in names}, {})
        of_errors, of_times = evaluation.compare(results, evaluation.judge(results))
        assert of_errors.keys() == differ
        assert of_times == {}


# --- the page --------------------------------------------------------------------------------------------------------


def test_the_page_has_a_section_for_each_kind_of_case_with_words_and_numbers() -> None:
    rows, verdicts = [row("joint", 0.1, linearised=fives(1.0), bound=fives(2.0))], {"step_up": "So it <went>."}
    page, drawn_figures = compare_page.build(
        Results(Plan(3, 12.0, 7), stepped().outcomes, {}), rows, verdicts, [], table.tables(rows, [])
    )
    reader = Reader(page)
    assert list(figures(reader)) == list(drawn_figures) == [
        "linearised-lever", "bound-lever", "settling-step_up", "following-step_up"
    ]  # fmt: skip
    words = " ".join("".join(reader.text).split())
    assert "3 runs of 12 s of each case, seed 7." in words
    assert "Who wins where" in words
    assert "So it &lt;went&gt;." in page
    assert "All numbers" in words
    assert "Against what can be reached: lever" in words
    assert "After the step: k_p and c_p × 1.3, seen by lever" in words
    ids = {attributes["id"] for _, attributes in reader.tags if attributes.get("id")}
    assert {"winners", "numbers", "model-lever", "step-step_up"} <= ids
