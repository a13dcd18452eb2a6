"""What each chart shows: the titles of its axes, its curves and their looks, limits, and the words beside it."""

from __future__ import annotations

import html
import math
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from lever_cdkf.firmware.estimator import TEST_RATIOS
from lever_cdkf.report import captions, summary_html
from lever_cdkf.report.charts import health, signals, stability, tracking, transfer
from lever_cdkf.report.figure import Figure, Spec, axis_range, edges
from lever_cdkf.report.run import Run
from lever_cdkf.results import trust
from lever_cdkf.results.faults import LITTLE
from lever_sil.run.runner import SimulationResult

from .reading import Reader, figures, read, unpack

TIME = "time [s]"
AXES = {
    "parameters": (TIME, "m<sub>p</sub> [kg]", "c<sub>p</sub> [N s/m]", "k<sub>p</sub> [N/m]"),
    "dynamics": (TIME, "f<sub>n</sub> [Hz]", "ζ [1]"),
    "map-truth": (TIME, "frequency [Hz]"),
    "map-estimate": (TIME, "frequency [Hz]"),
    "slices": ("frequency [Hz]", "θ/z̈ [deg per m/s²]", "phase [deg]", "coherence [1]"),
    "detail": (TIME, "angle θ [deg]", "rate θ̇ [deg/s]"),
    "motion": (TIME, "angle θ [deg]", "rate θ̇ [deg/s]"),
    "innovations": (TIME, "NIS per output [1]"),
    "whiteness": ("lag [ms]", "correlation [1]"),
    "excitation": (TIME, "base z̈ [m/s²]", "torque τ<sub>m</sub> [N m]", "rms θ̇ [rad/s]"),
    "spectra": ("frequency [Hz]", "z̈ [m/s² per √Hz]", "τ<sub>m</sub> [N m per √Hz]"),
    "health": (TIME, "", "frames so far"),
}
LINKED = ("parameters", "dynamics", "map-truth", "map-estimate", "motion", "innovations", "excitation", "health")
"""Figures over the time of the run: to zoom one zooms all."""


@pytest.fixture(scope="module")
def page(report: Path) -> Reader:
    return read(report)


@pytest.fixture(scope="module")
def drawn(page: Reader) -> dict[str, Any]:
    return {key.removeprefix("figure-"): figure for key, figure in figures(page).items()}


def rows_of(layout: Spec) -> list[str]:
    return [key for key in layout if key.startswith("yaxis")]


@pytest.mark.parametrize("key", AXES)
def test_titles_of_axes(key: str, drawn: dict[str, Any]) -> None:
    layout = drawn[key]["layout"]
    assert (layout["xaxis"]["title"]["text"], *(layout[row]["title"]["text"] for row in rows_of(layout))) == AXES[key]
    assert drawn[key]["over_time"] is (key in LINKED)
    assert layout["xaxis"]["anchor"] == rows_of(layout)[-1].replace("axis", "")


def test_over_time_all_begin_at_0_and_end_with_the_run(drawn: dict[str, Any], result: SimulationResult) -> None:
    for key in LINKED:
        assert drawn[key]["layout"]["xaxis"]["range"] == [0.0, result.trace["time_s"][-1]], key
        assert drawn[key]["layout"]["xaxis"]["unifiedhovertitle"] == {"text": "%{x:.2f} s"}


def test_frequency_axes_are_logarithmic(drawn: dict[str, Any]) -> None:
    for key, low, high in (("slices", 0.5, 12.0), ("spectra", 0.25, 50.0)):
        axis = drawn[key]["layout"]["xaxis"]
        assert axis["type"] == "log"
        assert axis["range"] == pytest.approx([math.log10(low), math.log10(high)])
        assert axis["tickvals"] == [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50]
        assert axis["unifiedhovertitle"] == {"text": "%{x:.3g} Hz"}
    assert drawn["slices"]["layout"]["yaxis"]["type"] == "log"
    assert drawn["slices"]["layout"]["yaxis2"]["dtick"] == 45
    assert drawn["map-truth"]["layout"]["yaxis"]["range"] == [0.5, 12.0]


def test_rows_share_the_height_without_overlap(drawn: dict[str, Any]) -> None:
    for key, figure in drawn.items():
        layout = figure["layout"]
        spans = [layout[row]["domain"] for row in rows_of(layout)]
        assert spans[0][1] == 1.0
        assert spans[-1][0] == pytest.approx(0.0, abs=1e-12), key
        for above, below in pairwise(spans):
            assert (above[0] - below[1]) * layout["height"] == pytest.approx(22)  # ROW_GAP
        assert all("weight" not in layout[row] for row in rows_of(layout))
    high, _, low = (np.diff(drawn["slices"]["layout"][row]["domain"])[0] for row in ("yaxis", "yaxis2", "yaxis3"))
    assert low == pytest.approx(0.5 * high)


LOOKS: dict[str, dict[str, tuple[str, float, str]]] = {
    "parameters": {
        "truth": ("truth", 1.8, "dash"), "estimate": ("estimate", 1.8, "solid"),
        "estimate, flagged: do not trust": ("quiet", 2.4, "solid"),
    },
    "slices": {
        "truth": ("truth", 1.8, "dash"), "estimate": ("estimate", 1.8, "solid"),
        "measured coherence": ("measured", 1.8, "solid"), "95 % of chance alone": ("mark", 1.2, "dash"),
    },
    "detail": {"truth": ("truth", 1.5, "dash"), "estimate": ("estimate", 1.8, "solid")},
    "motion": {
        "measured": ("measured", 1, "solid"), "truth": ("truth", 1, "solid"), "estimate": ("estimate", 1, "solid"),
    },
    "excitation": {
        "base acceleration z̈": ("base", 1, "solid"), "motor torque τ<sub>m</sub>": ("torque", 1, "solid"),
        "motion seen by the estimator": ("estimate", 1.8, "solid"), "least motion to learn from": ("mark", 1.2, "dash"),
    },
    "spectra": {
        "base acceleration z̈": ("base", 1.8, "solid"), "motor torque τ<sub>m</sub>": ("torque", 1.8, "solid"),
    },
}  # fmt: skip


@pytest.mark.parametrize("key", LOOKS)
def test_curves_are_told_apart(key: str, drawn: dict[str, Any]) -> None:
    found = {
        trace["name"]: (
            trace["line"]["color"].removeprefix("@"),
            trace["line"]["width"],
            trace["line"].get("dash", "solid"),
        )
        for trace in drawn[key]["data"]
        if trace["mode"] == "lines" and trace["line"]["width"]
    }
    assert found == LOOKS[key]


def test_a_name_is_once_in_the_legend(drawn: dict[str, Any]) -> None:
    for key in ("parameters", "dynamics", "slices", "motion", "excitation", "innovations", "whiteness"):
        traces = drawn[key]["data"]
        listed = [trace["name"] for trace in traces if trace.get("showlegend", True)]
        assert len(listed) == len(set(listed)), key
        assert set(listed) == {trace["name"] for trace in traces}
        ranks = [trace["legendrank"] for trace in traces if "legendrank" in trace]
        assert ranks == [1000 + int(t["yaxis"][1:] or 1) - 1 for t in traces if "legendrank" in t]
    for trace in drawn["detail"]["data"]:
        assert trace["showlegend"] is (trace["yaxis"] == "y")


def test_bands_are_filled_between_their_edges(drawn: dict[str, Any]) -> None:
    for key, colour in (("parameters", "estimate-band"), ("innovations", "chance-band"), ("whiteness", "chance-band")):
        low, high = drawn[key]["data"][:2]
        assert "fill" not in low
        assert (high["fill"], high["fillcolor"]) == ("tonexty", f"@{colour}")
        assert low["hoverinfo"] == high["hoverinfo"] == "skip"
        assert low["line"]["width"] == high["line"]["width"] == 0
        assert low["showlegend"] is False


def test_the_pointer_says_what_a_curve_is_in_its_unit(drawn: dict[str, Any]) -> None:
    said = {
        trace["hovertemplate"]
        for key in ("parameters", "dynamics")
        for trace in drawn[key]["data"]
        if "hovertemplate" in trace
    }
    names = {"mass": " kg", "damping": " N s/m", "stiffness": " N/m", "natural frequency": " Hz", "damping ratio": ""}
    assert said == {
        f"{kind} {name} %{{y:.4g}}{unit}<extra></extra>"
        for kind in ("true", "estimated")
        for name, unit in names.items()
    }


def test_axes_show_what_is_there(drawn: dict[str, Any], result: SimulationResult) -> None:
    """With a margin of 8 % above and below what there is after the first tenth."""
    columns = [result.trace[f"natural_frequency_{kind}_Hz"] for kind in ("true", "estimate", "sigma")]
    later = slice(len(columns[0]) // 10, None)
    true, estimate, sigma = (column[later] for column in columns)
    values = np.concatenate((true, estimate - 2.0 * sigma, estimate + 2.0 * sigma))
    margin = 0.08 * (np.nanmax(values) - np.nanmin(values))
    shown = drawn["dynamics"]["layout"]["yaxis"]["range"]
    assert shown == pytest.approx([np.nanmin(values) - margin, np.nanmax(values) + margin])


def test_both_maps_have_the_colours_of_the_truth(drawn: dict[str, Any]) -> None:
    truth, estimate = (drawn[f"map-{name}"]["data"][0] for name in ("truth", "estimate"))
    assert truth["zmin"] == estimate["zmin"] == 0.0
    assert truth["zmax"] == estimate["zmax"] == pytest.approx(unpack(truth["z"]).max(), rel=1e-4)
    assert truth["type"] == "heatmap"
    assert truth["colorscale"] == "Viridis"
    assert truth["colorbar"]["title"] == {"text": "deg per m/s²", "side": "right"}
    assert truth["hovertemplate"] == "%{x:.1f} s, %{y:.1f} Hz: %{z:.3f} deg per m/s²<extra></extra>"
    curve = drawn["map-truth"]["data"][1]
    assert (curve["name"], curve["line"], curve["showlegend"]) == (
        "natural frequency", {"color": "@on-map", "width": 1.2}, False,
    )  # fmt: skip


def test_the_slider_goes_through_the_run(drawn: dict[str, Any], result: SimulationResult) -> None:
    choices = drawn["slices"]["choices"]
    steps = choices["of"]
    assert (choices["slider"], len(steps)) == ("time", 25)
    assert [step["label"] for step in steps][-1] == f"{result.trace['time_s'][-1]:.3g} s"
    times = [float(step["label"].removesuffix(" s")) for step in steps]
    assert times == sorted(times)
    assert choices["first"] == 20
    shown = steps[20]["data"]["y"]
    for trace, curve in zip(drawn["slices"]["data"], shown, strict=False):
        assert unpack(trace["y"]) == pytest.approx(unpack(curve), rel=1e-3)


def test_close_ups_are_two_seconds_from_a_half_before_a_change(drawn: dict[str, Any], result: SimulationResult) -> None:
    choices = drawn["detail"]["choices"]
    end = result.trace["time_s"][-1]
    ranges = [button["layout"]["xaxis.range"] for button in choices["of"]]
    assert ranges == [pytest.approx(pair, abs=2e-3) for pair in ([0.0, 2.0], [7.5, 9.5], [end - 2.0, end])]
    assert (choices["first"], choices["slider"]) == (0, "")
    assert [trace["visible"] for trace in drawn["detail"]["data"]] == choices["of"][0]["data"]["visible"]


def test_levels_and_marks(drawn: dict[str, Any]) -> None:
    look = {"color": "@mark", "width": 1, "dash": "dot"}
    (jump,) = drawn["dynamics"]["layout"]["shapes"]
    assert (jump["type"], jump["line"], jump["x0"], jump["y0"], jump["y1"], jump["yref"]) == (
        "line", look, jump["x1"], 0, 1, "paper",
    )  # fmt: skip
    limits = drawn["whiteness"]["layout"]["shapes"]
    assert [shape["y0"] for shape in limits] == [-0.2, 0.2]
    assert all(shape["y0"] == shape["y1"] and (shape["x0"], shape["x1"]) == (0, 1) for shape in limits)
    assert all(shape["xref"] == "paper" and shape["line"] == look for shape in limits)
    bars = drawn["whiteness"]["data"][-1]
    assert (bars["type"], bars["width"], bars["marker"]) == ("bar", pytest.approx(6.0), {"color": "@estimate"})
    assert drawn["whiteness"]["layout"]["xaxis"]["range"] == [0.0, pytest.approx(520.0)]
    (words,) = drawn["spectra"]["layout"]["annotations"]
    assert (words["text"], words["showarrow"]) == ("natural frequency", False)
    (box,) = drawn["spectra"]["layout"]["shapes"]
    assert (box["type"], box["fillcolor"], box["layer"]) == ("rect", "@chance-band", "below")


def test_the_least_motion_is_the_setting(drawn: dict[str, Any], result: SimulationResult) -> None:
    (least,) = (trace for trace in drawn["excitation"]["data"] if trace["name"] == "least motion to learn from")
    assert unpack(least["y"]) == pytest.approx(result.summary.estimator.settings["excitation_least"], rel=1e-6)
    assert unpack(least["x"]) == pytest.approx([0.0, result.trace["time_s"][-1]])


def test_lanes_of_the_health(drawn: dict[str, Any]) -> None:
    layout, bars = drawn["health"]["layout"], [t for t in drawn["health"]["data"] if t["yaxis"] == "y"]
    lanes = layout["yaxis"]
    assert lanes["categoryarray"] == [bar["name"] for bar in bars][::-1]
    assert lanes["range"] == [-0.6, len(bars) - 0.4]
    assert layout["height"] == 110 + 26 * len(bars) + 150
    for bar in bars:
        assert bar["line"] == {"color": "@estimate" if bar["name"].startswith("mode") else "@fault", "width": 12}
        assert bar["showlegend"] is False
        assert bar["hovertemplate"].endswith(" %{x:.2f} s<extra></extra>")
        assert {name for name in bar["y"] if name} == {bar["name"]}
        x = unpack(bar["x"]).reshape(-1, 3)
        assert np.isnan(x[:, 2]).all()  # a gap after each stretch
        assert (x[:, 1] - x[:, 0]).min() > 0.0019 * layout["xaxis"]["range"][1]
    (lost,) = (t for t in drawn["health"]["data"] if t["name"] == "lost")
    assert lost["line"]["shape"] == "hv"


# --- charts that this run has not ------------------------------------------------------------------------------------


def of(result: SimulationResult, **columns: Any) -> Run:
    """Return the run with other columns; a number is one everywhere."""
    count = len(result.trace["time_s"])
    full = {name: np.full(count, value) if np.ndim(value) == 0 else value for name, value in columns.items()}
    return Run({**result.trace, **full}, result.summary)


MARGIN = {"gain_margin_dB": 3.0, "gain_margin_sigma_dB": 1.0, "bounce_frequency_Hz": 4.0}


def test_the_margin_with_all_that_can_be_known(result: SimulationResult) -> None:
    time = result.trace["time_s"]
    state = np.where(time < 2.0, 3.0, np.where(time < 4.0, 2.0, 1.0))  # alarm, warning, clear
    more = {"gain_margin_true_dB": 2.5, "correction_rad": 0.01}
    figure = stability.margin(of(result, **MARGIN, **more, bounce=state), (6.0, 3.5))
    assert figure is not None
    layout = figure.spec()["layout"]
    assert [layout[row]["title"]["text"] for row in rows_of(layout)] == [
        "gain margin [dB]", "frequency [Hz]", "correction [°]",
    ]  # fmt: skip
    assert layout["height"] == 450
    traces = {trace["name"]: trace for trace in figure.traces}
    assert [*traces] == [
        "warning", "alarm", "margin ± 2σ", "gain margin", "critical frequency", "truth", "correction",
    ]  # fmt: skip
    assert {name: trace["line"].get("color") for name, trace in traces.items()} == {
        "warning": "@joint", "alarm": "@fault", "margin ± 2σ": None, "gain margin": "@estimate",
        "critical frequency": "@violet", "truth": "@truth", "correction": "@good",
    }  # fmt: skip
    assert [traces[name]["yaxis"] for name in ("gain margin", "critical frequency", "correction")] == ["y", "y2", "y3"]
    expected = {"gain margin": 3.0, "critical frequency": 4.0, "truth": 2.5, "correction": math.degrees(0.01)}
    for name, value in expected.items():
        assert unpack(traces[name]["y"]) == pytest.approx(value, rel=1e-6)
    assert [traces[name]["hovertemplate"] for name in expected] == [
        "gain margin %{y:.4g} dB<extra></extra>", "critical frequency %{y:.4g} Hz<extra></extra>",
        "true gain margin %{y:.4g} dB<extra></extra>", "correction %{y:.4g} °<extra></extra>",
    ]  # fmt: skip
    assert [shape["y0"] for shape in figure.shapes if "xref" in shape] == [0.0, 6.0, 3.5]
    span = layout["yaxis"]["range"]
    assert span == pytest.approx([-0.08 * 6.0, 6.0 + 0.08 * 6.0])  # from the limit at 0 to that of warning
    for name, begin, end in (("alarm", 0.0, 2.0), ("warning", 2.0, 4.0)):
        x, y = unpack(traces[name]["x"]), unpack(traces[name]["y"])
        inside = np.isfinite(y)
        assert (x[inside].min(), x[inside].max()) == (pytest.approx(begin, abs=0.02), pytest.approx(end, abs=0.02))
        assert y[inside] == pytest.approx(span[0], rel=1e-5)
        assert traces[name]["hovertemplate"] == f"{name}<extra></extra>"
        assert (traces[name]["line"]["width"], traces[name]["connectgaps"]) == (10, False)


def test_without_an_aircraft_there_is_no_margin(result: SimulationResult) -> None:
    assert stability.margin(Run(result.trace, result.summary)) is None
    figure = stability.margin(of(result, **MARGIN, bounce=1.0))
    assert figure is not None
    assert {trace["name"] for trace in figure.traces} == {"margin ± 2σ", "gain margin", "critical frequency"}
    assert figure.height == 400


@pytest.mark.parametrize(("ratio", "top"), [(0.5, 1.5), (2.0, 2.2), (9.0, 3.0)])
def test_the_scale_of_test_ratios(ratio: float, top: float, result: SimulationResult) -> None:
    count = len(result.trace["time_s"])
    figure = health.test_ratios(of(result, evidence=np.arange(float(count)) % len(TEST_RATIOS), test_ratio=ratio))
    assert figure is not None
    layout = figure.spec()["layout"]
    assert layout["yaxis"]["range"] == [0.0, pytest.approx(top)]
    assert layout["yaxis"]["title"]["text"] == "test ratio [1]"
    assert [trace["name"] for trace in figure.traces] == [
        *(name.replace("_", " ") for name in TEST_RATIOS),
        "threshold",
    ]
    threshold = figure.traces[-1]
    assert list(unpack(threshold["y"])) == [1.0, 1.0]
    assert (threshold["line"]["color"], threshold["line"]["dash"]) == ("@mark", "dot")
    assert figure.traces[0]["hovertemplate"] == f"{TEST_RATIOS[0].replace('_', ' ')} %{{y:.4g}}<extra></extra>"
    assert health.test_ratios(Run(result.trace, result.summary)) is None


def test_recorded_estimates_lie_under_those_of_the_replay(result: SimulationResult) -> None:
    figure = tracking.recorded(of(result, m_p_recorded_kg=2.0, k_p_recorded_N_m=1500.0))
    assert figure is not None
    layout = figure.spec()["layout"]
    assert [layout[row]["title"]["text"] for row in rows_of(layout)] == ["m<sub>p</sub> [kg]", "k<sub>p</sub> [N/m]"]
    assert layout["height"] == 340
    assert [(t["name"], t["line"]["color"], t["line"]["width"], t["yaxis"]) for t in figure.traces] == [
        ("recorded", "@base", 3.0, "y"), ("replayed", "@estimate", 1.2, "y"),
        ("recorded", "@base", 3.0, "y2"), ("replayed", "@estimate", 1.2, "y2"),
    ]  # fmt: skip
    assert unpack(figure.traces[2]["y"]) == pytest.approx(1500.0)
    assert tracking.recorded(Run(result.trace, result.summary)) is None


@pytest.mark.parametrize(
    ("nis", "scale"), [(2.0, {"range": [0.0, 2.0]}), (5.0, {"range": [0.0, 2.75]}), (80.0, {"type": "log"})]
)
def test_the_scale_of_innovations(nis: float, scale: dict[str, Any], result: SimulationResult) -> None:
    both = {"theta_measured_rad": 0.3, "theta_dot_measured_rad_s": 0.0}  # two outputs in each sample
    figure = signals.innovations(of(result, nis=nis, **both))
    assert figure is not None
    layout = figure.spec()["layout"]["yaxis"]
    assert {key: layout[key] for key in ("range", "type") if key in layout} == {
        key: pytest.approx(value) if key == "range" else value for key, value in scale.items()
    }
    assert unpack(figure.traces[-1]["y"]) == pytest.approx(nis / 2.0)
    assert signals.innovations(of(result, nis=np.nan)) is None


def test_a_label_of_the_slider_is_short(result: SimulationResult) -> None:
    time = result.trace["time_s"] * 100.0
    figure = transfer.slices(of(result, time_s=time))
    assert figure is not None
    assert figure.choices["of"][-1]["label"] == f"{time[-1]:.0f} s"


# --- building blocks -------------------------------------------------------------------------------------------------


def test_edges_stop_at_what_can_be() -> None:
    low, high = edges(np.array([1.0, 5.0]), np.array([1.0, 0.5]), least=0.0, most=5.5)
    assert (list(low), list(high)) == ([0.0, 4.0], [3.0, 5.5])
    low, high = edges(np.array([1.0]), np.array([1.0]), sigmas=3.0)
    assert (low[0], high[0]) == (-2.0, 4.0)


@pytest.mark.parametrize(
    ("values", "expected"),
    [([0.0, 10.0], [-0.8, 10.8]), ([5.0, 5.0], [4.6, 5.4]), ([0.0, 0.0], [-0.08, 0.08]), ([np.nan], None)],
)
def test_the_range_of_an_axis(values: list[float], expected: list[float] | None) -> None:
    found = axis_range([np.array([99.0, *values])], slice(1, None))
    assert found == (None if expected is None else pytest.approx(expected))


def test_a_row_has_its_name_at_its_left_end() -> None:
    figure = Figure([{}, {}], {})
    figure.name_row(0, "a < b")
    figure.name_row(1, "c")
    first, second = figure.annotations
    assert (first["text"], first["yref"], second["yref"]) == ("a &lt; b", "y domain", "y2 domain")
    assert {first[key] for key in ("xref", "xanchor", "yanchor", "showarrow")} == {"paper", "left", "bottom", False}
    assert (first["x"], first["y"]) == (0, 1)


# --- words and tables ------------------------------------------------------------------------------------------------


def test_headings_and_links(page: Reader) -> None:
    text = "".join(page.text)
    for words in (
        "Pilot's arm", "The pilot's arm", "Frequency and damping", "Natural frequency and damping", "About",
        "What you are looking at", "Bode diagram", "Biodynamic feedthrough: how the floor moves the lever", "States",
        "States and innovations", "Excitation", "Health", "Numbers", "All numbers", "Settings", "How this run was made",
        "Settings of the estimator (bold: not the default)", "Made by lever sim.", "Scenario",
    ):  # fmt: skip
        assert words in page.text or words in text, words
    assert "16\u2009000 samples in 16\u00a0s." in text


def test_headers_of_the_tables(page: Reader) -> None:
    answer, errors, run, scenario, settings = page.tables
    assert answer[0] == ["", "rms error", "in ±2σ", "stays below10 % after"]
    assert errors[0] == ["", "rms error[%]", "bias[%]", "within ±2σ", "stays below 10 % after[s]", "below 5 %[s]"]
    assert run[0] == ["", "value", "unit"]
    assert settings[0] == ["setting", "value", "unit", "meaning"]
    units = {row[0]: row[2] for row in run[1:]}
    assert {name: unit for name, unit in units.items() if unit} == {
        "mean normalised innovation squared": "1", "the same if σ is right": "1",
        "largest correlation of residuals": "1", "lost": "frames", "late": "frames", "simulated time": "s",
        "computing time": "s", "computing time ÷ simulated time": "1",
    }  # fmt: skip
    assert ["name", "short"] in scenario
    assert not any(row[0] == "description" for row in scenario)
    assert any(row[0] == "estimator.model" and row[1] == "lever" for row in scenario)
    assert not any(row[0].startswith("estimator.settings") for row in scenario)


def test_shares_of_faults_are_those_of_the_summary(page: Reader, result: SimulationResult) -> None:
    values = {row[0]: row[1] for row in page.tables[2][1:]}
    shares = {**result.summary.fault_shares, "any that warns": result.summary.flagged_share}
    found = {name: text for name, text in values.items() if " with fault: " in name}
    assert found == {
        f"of the judged time with fault: {name}": summary_html.percent(share) for name, share in shares.items()
    }


@pytest.mark.parametrize(
    ("value", "digits", "shown"),
    [
        (None, 3, "–"), (math.nan, 3, "–"), ("word", 3, "word"), (True, 3, "True"), (1234567, 3, "1\u2009234\u2009567"),
        (0.123456, 3, "0.123"), (999.6, 3, "1000"), (1000.4, 3, "1000"),
        (-12345.6, 3, "-12346"), (1.23456, 5, "1.2346"), (1e-5, 3, "1e-05"),
    ],
)  # fmt: skip
def test_figures_for_reading(value: Any, digits: int, shown: str) -> None:
    assert summary_html.number(value, digits) == shown


def test_other_figures_for_reading() -> None:
    assert [summary_html.fixed(value, 2, " s") for value in (1.2345, None)] == ["1.23 s", "–"]
    assert [summary_html.percent(value) for value in (0.9499, 1.0, 0.0, None)] == ["94.9 %", "100 %", "0 %", "–"]
    assert summary_html.seconds([1.25, None, 3.0]) == "1.2 / – / 3.0 s"
    assert summary_html.seconds([None, None]) == summary_html.seconds([]) == summary_html.seconds(None) == "–"


def test_nested_values_become_dotted_rows() -> None:
    nested = {"a": {"b": 1.5, "c": None, "d": ""}, "e": [1, 2.5], "f": [{"g": "x"}, {"g": "y"}], "h": [], "i": True}
    assert summary_html.flat(nested) == [
        ("a.b", "1.5"), ("e", "1, 2.5"), ("f.0.g", "x"), ("f.1.g", "y"), ("i", "True"),
    ]  # fmt: skip


def test_only_cells_of_words_are_marked_as_such() -> None:
    shown = summary_html.rows_table(
        [{"name": "a b", "said": "two words", "x": 1.23456}, {"name": "<c>", "said": "d", "x": None}]
    )
    assert shown.count('class="words"') == 3  # of a column with a sentence, its title too; never the first
    assert "<td>1.235</td>" in shown
    assert "<td>&lt;c&gt;</td>" in shown
    assert "<td>–</td>" in shown
    assert summary_html.rows_table([]) == ""


@pytest.mark.parametrize(
    ("share", "passed", "mood"),
    [(0.0, True, ""), (LITTLE + 1e-3, True, "watch"), (trust.MOST, True, "bad"), (0.0, False, "bad")],
)
def test_the_mood_of_a_recorded_run(share: float, passed: bool, mood: str, result: SimulationResult) -> None:
    """By how much of the time the estimator warns: there is no truth."""
    run = Run(result.trace, result.summary)
    run.simulated = None
    run.summary = replace(result.summary, flagged_share=share, passed=passed)
    assert f'class="verdict {mood}"' in summary_html.verdict(run)


def test_without_a_summary_the_last_estimates_are_the_answer(result: SimulationResult) -> None:
    shown = summary_html.answer(Run(result.trace, None))
    frequency, sigma = (result.trace[f"natural_frequency_{kind}_Hz"][-1] for kind in ("estimate", "sigma"))
    assert f"Natural frequency at the end: {frequency:.3g} ± {sigma:.2g} Hz" in shown
    assert "A recorded run, whose truth is not known." in shown
    assert "at the end, ± one σ" in shown
    ratio, its_sigma = (result.trace[f"damping_ratio_{kind}"][-1] for kind in ("estimate", "sigma"))
    assert f"<td>{ratio:.3g} ± {its_sigma:.2g}</td>" in shown
    without = {name: column for name, column in result.trace.items() if "estimate" not in name}
    assert "<strong>No estimate</strong>" in summary_html.answer(Run(without, None))


def test_captions_know_what_there_is(result: SimulationResult) -> None:
    run = Run(result.trace, result.summary)
    assert captions.parameters_caption(run).endswith("which the band should contain about 95 % of the time.")
    assert "whose common scale cancels in them" in captions.dynamics_caption(run)
    assert "only ratios of the three parameters can be known" in captions.excitation_caption(run)
    assert captions.about(run) == []
    blind = Run({name: values for name, values in result.trace.items() if "_true" not in name}, None)
    assert captions.parameters_caption(blind) == "Mass, damping and stiffness of the pilot's arm, with a band of ±2σ."
    assert "complex error" not in captions.feedthrough_caption(blind)
    assert html.unescape(captions.feedthrough_caption(run)).count("After the first third of the run") == 1
