"""The report: complete, self-contained, true to trace and summary, and without complaint in a browser."""

from __future__ import annotations

import re
import struct
import subprocess
import sys
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import screenshot
from lever_cdkf.errors import LeverError
from lever_cdkf.firmware.estimator import TEST_RATIOS
from lever_cdkf.firmware.native import enum_words
from lever_cdkf.report import captions, summary_html, write_report
from lever_cdkf.report.charts import health, stability, tracking
from lever_cdkf.report.run import COHERENT, Run
from lever_sil.run.runner import SimulationResult

from .reading import Reader, figures, first_number, read, unpack

SECTIONS = ["parameters", "dynamics", "explained", "bode", "states", "excitation", "health", "numbers", "made"]
_NAMES = "parameters dynamics map-truth map-estimate slices detail motion innovations whiteness excitation spectra"
FIGURES = [*(f"figure-{name}" for name in _NAMES.split()), "figure-health"]
ROWS = {"m_p": "mp mass", "c_p": "cp damping", "k_p": "kp stiffness"}
ROWS |= {"natural_frequency": "fn natural frequency", "damping_ratio": "ζ damping ratio"}
BROWSER = pytest.mark.requires("|".join(screenshot.BROWSERS))


@pytest.fixture(scope="module")
def page(report: Path) -> Reader:
    return read(report)


# --- structure -------------------------------------------------------------------------------------------------------


def test_sections_and_figures_are_all_there_in_order(page: Reader) -> None:
    assert page.ids("section") == SECTIONS
    assert page.ids("div") == FIGURES
    drawn = figures(page)
    assert list(drawn) == FIGURES
    for key, figure in drawn.items():
        rows = sum(axis.startswith("yaxis") for axis in figure["layout"])
        assert 140 * rows <= figure["layout"]["height"] <= 400 * rows, key
    assert [attributes["href"] for tag, attributes in page.tags if tag == "a"] == [f"#{key}" for key in SECTIONS]
    assert page.open == []


def test_nothing_is_loaded_from_elsewhere(page: Reader, report: Path) -> None:
    for tag, attributes in page.tags:
        assert tag not in ("link", "iframe", "img", "object", "embed"), tag
        for name in ("src", "href", "xlink:href", "action", "data"):
            assert (attributes.get(name) or "#").startswith("#"), (tag, attributes)
    own = report.read_text(encoding="utf-8").replace(page.scripts[1], "")
    assert not re.search(r"https?:|//\w+\.|@import|url\((?!#)", own)
    policy = [attributes["content"] for _, attributes in page.tags if "http-equiv" in attributes]
    assert policy == ["default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:"]


def test_no_button_sends_data_away(page: Reader) -> None:
    assert "showSendToCloud: false" in page.scripts[2]


def test_every_axis_has_a_unit_and_every_figure_a_caption(page: Reader) -> None:
    for key, figure in figures(page).items():
        for name, axis in figure["layout"].items():
            if re.fullmatch(r"[xy]axis\d*", name) and axis.get("type") != "category":
                title = axis["title"]["text"]
                assert re.search(r"\[.+\]$", title) or title == "frames so far", (key, name, title)
    assert len(page.captions) == len(FIGURES)
    assert min(len(caption) for caption in page.captions) > 40


def test_what_the_scenario_says_is_escaped(page: Reader, report: Path) -> None:
    assert "<startled>" not in report.read_text(encoding="utf-8")
    assert "A pilot <startled> after 8 s" in "".join(page.text)


# --- numbers ---------------------------------------------------------------------------------------------------------


def test_tables_say_what_the_summary_says(page: Reader, result: SimulationResult) -> None:
    errors, run = page.tables[1], page.tables[2]
    rows = {row[0]: row[1:] for row in errors[1:]}
    assert list(rows) == list(ROWS.values())
    for key, name in ROWS.items():
        expected, row = asdict(result.summary.parameters[key]), rows[name]
        assert float(row[0]) == pytest.approx(expected["rms_percent"], abs=0.005)
        assert float(row[1]) == pytest.approx(expected["bias_percent"], abs=0.005)
        assert first_number(row[2]) == pytest.approx(100.0 * expected["coverage_2sigma"], abs=0.1)
        for cell, times in ((row[3], "time_to_10_percent_s"), (row[4], "time_to_5_percent_s")):
            shown = [None if text == "–" else float(text) for text in cell.split(", ")]
            assert shown == [None if time is None else pytest.approx(time, abs=0.0051) for time in expected[times]]
    values = {row[0]: row[1] for row in run[1:]}
    summary = result.summary
    assert {label: first_number(values[label]) for label in list(values)[4:12]} == {
        "samples": summary.samples, "lost": summary.lost,
        "corrupt frames and implausible values": summary.corrupt, "late": summary.late,
        "restarts of the filter": summary.restarts, "samples without an answer": summary.unanswered,
        "estimates of other samples": summary.misplaced, "simulated time": summary.simulated_time_s,
    }  # fmt: skip
    assert summary.lost > 0
    assert values["computing time"] == summary_html.number(summary.wall_time_s)
    nis = asdict(result.summary.nis)
    assert float(values["mean normalised innovation squared"]) == pytest.approx(nis["mean"], rel=5e-3)
    inside = first_number(values["innovations inside their 95 % bound"])
    assert inside == pytest.approx(100 * nis["inside_95_percent"], abs=0.1)


def test_the_answer_says_what_the_summary_says(page: Reader, result: SimulationResult) -> None:
    text, shown = "".join(page.text).replace("\u00a0", " "), {row[0]: row[1:3] for row in page.tables[0]}
    detailed = {row[0]: row[3] for row in page.tables[1]}
    for key, name in ROWS.items():
        expected = asdict(result.summary.parameters[key])
        assert shown[name] == [f"{expected['rms_percent']:.1f} %", detailed[name]], "a share is rounded in one way"
    least = min((detailed[name] for name in ROWS.values()), key=first_number)
    assert f"±2σ covers every truth for at least {least} of the time" in text
    assert f"Natural frequency: {shown[ROWS['natural_frequency']][0]} rms error" in text
    assert "in % of the truth, from 4 s after the start and each sudden change on." in text
    verdict = result.summary.verdict.replace(result.summary.warning, "").strip()
    assert result.summary.warning in text
    assert re.sub(r"\b([mck])_p\b", r"\1p", verdict) in text


def test_what_a_short_run_cannot_say_is_a_dash_without_a_unit(result: SimulationResult) -> None:
    figures = {
        name: replace(each, rms_percent=None, coverage_2sigma=None) for name, each in result.summary.parameters.items()
    }
    shown = summary_html.answer(Run(result.trace, replace(result.summary, parameters=figures)))
    assert "– %" not in shown.replace("\u00a0", " ")
    assert "–" in shown


@pytest.mark.parametrize(
    ("passed", "error", "covered", "white", "mood"),
    [
        (True, 9.9, 0.91, True, "good"),
        (True, 9.9, 0.89, True, "watch"),  # what the limits allow is no proof of the stated sigma
        (True, 9.9, 0.95, False, "watch"),
        (True, 17.0, 0.95, True, "watch"),
        (False, 9.9, 0.95, True, "bad"),
    ],
)
def test_the_headline_is_good_only_if_errors_sigma_and_whiteness_are(
    passed: bool, error: float, covered: float, white: bool, mood: str, result: SimulationResult
) -> None:
    summary = result.summary
    assert summary.whiteness is not None
    entries = {
        key: replace(entry, rms_percent=error, coverage_2sigma=covered) for key, entry in summary.parameters.items()
    }
    changed = replace(summary, passed=passed, parameters=entries, whiteness=replace(summary.whiteness, white=white))
    assert f'class="verdict {mood}"' in summary_html.verdict(Run(result.trace, changed))


def test_all_settings_are_shown(page: Reader, result: SimulationResult) -> None:
    shown = {row[0]: row[1] for row in page.tables[-1][1:]}
    settings = result.summary.estimator.settings
    assert list(shown) == list(settings)
    assert {name: float(value) for name, value in shown.items()} == pytest.approx(settings, rel=1e-5)


# --- figures ---------------------------------------------------------------------------------------------------------


def traces(page: Reader, figure: str, name: str) -> list[dict[str, Any]]:
    return [trace for trace in figures(page)[figure]["data"] if trace["name"] == name]


def at(result: SimulationResult, x: np.ndarray, column: str) -> np.ndarray:
    """Return a column at the samples nearest to the times x."""
    return result.trace[column][np.searchsorted(result.trace["time_s"], x - 5e-4)]


def test_parameter_curves_are_those_of_the_trace(page: Reader, result: SimulationResult) -> None:
    for row, (key, suffix) in enumerate((("m_p", "_kg"), ("c_p", "_N_s_m"), ("k_p", "_N_m"))):
        for name, kind in (("truth", "true"), ("estimate", "estimate")):
            trace = traces(page, "figure-parameters", name)[row]
            x = unpack(trace["x"])
            np.testing.assert_allclose(unpack(trace["y"]), at(result, x, f"{key}_{kind}{suffix}"), rtol=1e-6)
            assert 1000 < len(x) < 2000
        lower, upper = traces(page, "figure-parameters", "estimate ± 2σ")[2 * row : 2 * row + 2]
        x = unpack(upper["x"])
        width = 4.0 * at(result, x, f"{key}_sigma{suffix}")
        inside = unpack(lower["y"]) > 0.0
        np.testing.assert_allclose((unpack(upper["y"]) - unpack(lower["y"]))[inside], width[inside], rtol=1e-4)


def test_estimates_that_are_flagged_are_grey(result: SimulationResult) -> None:
    """By a curve over that of all estimates, by the mask of the faults that say "do not trust this"; one of both says
    the value at the cursor."""
    faults = np.where(result.trace["time_s"] < 6.0, 0.0, 65536.0)  # calibration
    run = Run({**result.trace, "faults": faults}, result.summary)
    figure = tracking.parameters(run)
    assert figure is not None
    curves = {trace["name"]: trace for trace in figure.traces if trace["name"].startswith("estimate")}
    grey = curves["estimate, flagged: do not trust"]
    assert grey["line"]["color"] == "@quiet"
    x = unpack(grey["x"])
    known = np.isfinite(at(result, x, "k_p_estimate_N_m"))
    assert np.array_equal(np.isfinite(unpack(curves["estimate"]["y"])), known)
    assert np.array_equal(np.isfinite(unpack(grey["y"])), known & (x >= 6.0))
    assert grey["line"]["width"] > curves["estimate"]["line"]["width"]
    assert grey["hoverinfo"] == "skip"
    assert "hovertemplate" not in grey


def test_the_margin_s_caption_says_how_far_it_was_from_the_truth(result: SimulationResult) -> None:
    """By closed form: 2 dB too high with a σ of 1.5 dB, but for the first third, which is not counted, and a quarter
    of the rest, where it is 5 dB too low."""
    time = result.trace["time_s"]
    late = time >= time[-1] - (time[-1] - time[0]) / 6.0
    error = np.where(time < time[-1] / 3.0, 40.0, np.where(late, -5.0, 2.0))
    known = {"gain_margin_dB": 3.0 + error, "gain_margin_sigma_dB": np.full(len(time), 1.5)}
    run = Run({**result.trace, **known, "gain_margin_true_dB": np.full(len(time), 3.0)}, result.summary)
    assert "2.0 dB too high (median" in captions.margin_caption(run)
    assert "held the true one 74.9 % of the time" in captions.margin_caption(run)
    without = Run({**result.trace, **known}, result.summary)
    assert "truth" not in captions.margin_caption(without)
    assert "held" not in captions.margin_caption(without)


def test_the_margin_is_drawn_with_two_standard_deviations(result: SimulationResult) -> None:
    ones = np.ones(len(result.trace["time_s"]))
    known = {"gain_margin_dB": 3.0 * ones, "gain_margin_sigma_dB": 1.5 * ones}
    run = Run({**result.trace, **known, "bounce": 0.0 * ones, "bounce_frequency_Hz": 4.0 * ones}, result.summary)
    figure = stability.margin(run)
    assert figure is not None
    drawn = [unpack(trace["y"]) for trace in figure.traces[:3]]
    assert [(edge.min(), edge.max()) for edge in drawn] == [(0.0, 0.0), (6.0, 6.0), (3.0, 3.0)]


def test_each_test_ratio_has_a_look_of_its_own(result: SimulationResult) -> None:
    """Which plotly.js knows: of others it draws a plain line, and says nothing."""
    count = len(result.trace["time_s"])
    columns = {"evidence": np.arange(float(count)) % len(TEST_RATIOS), "test_ratio": np.full(count, 0.5)}
    figure = health.test_ratios(Run({**result.trace, **columns}, result.summary))
    assert figure is not None
    looks = [(trace["line"]["color"], trace["line"]["dash"]) for trace in figure.traces[: len(TEST_RATIOS)]]
    assert len(set(looks)) == len(TEST_RATIOS)
    assert {dash for _, dash in looks} <= {"solid", "dot", "dash", "longdash", "dashdot", "longdashdot"}


def test_the_headline_begins_with_the_warning(result: SimulationResult) -> None:
    warned = replace(result.summary, warning="Do not trust the estimates: x (100 % of the time).", flagged_share=1.0)
    shown = summary_html.verdict(Run(result.trace, warned))
    assert shown.startswith('<p class="verdict bad"><strong>Do not trust the estimates: x (100\u00a0% of the time).')


def test_a_jump_is_drawn_where_it_is_and_marked(page: Reader) -> None:
    trace = traces(page, "figure-parameters", "truth")[2]
    x, y = unpack(trace["x"]), unpack(trace["y"])
    after = int(np.flatnonzero(np.diff(y) > 100.0)[0]) + 1
    assert x[after] == pytest.approx(8.0, abs=1.1e-3)
    assert x[after] - x[after - 1] == pytest.approx(1e-3, abs=1e-4)
    shapes = figures(page)["figure-parameters"]["layout"]["shapes"]
    assert [shape["x0"] for shape in shapes] == [pytest.approx(8.0, abs=1.1e-3)]


def test_maps_and_slices_are_the_response_of_the_parameters(page: Reader, result: SimulationResult) -> None:
    """Against the transfer function by scipy, from the columns of the trace and firmware/THEORY.md."""
    signal = pytest.importorskip("scipy.signal")
    s = result.summary.estimator.settings
    heat = figures(page)["figure-map-truth"]["data"][0]
    time, frequency, z = (unpack(heat[axis]) for axis in "xyz")
    length, slice_of = s["lever_length"], figures(page)["figure-slices"]["choices"]["of"]
    for index in (0, len(time) // 2, len(time) - 1):
        m_p, c_p, k_p, trim = (
            float(at(result, time[index : index + 1], f"{name}")[0])
            for name in ("m_p_true_kg", "c_p_true_N_s_m", "k_p_true_N_m", "trim_true_rad")
        )
        cosine = np.cos(trim)
        inertia = length**2 * (s["lever_mass_position"] ** 2 * s["lever_mass"] + m_p) + s["lever_inertia"]
        damping = c_p * length**2 * cosine**2 + s["lever_damping"]
        stiffness = k_p * length**2 * cosine**2 + s["lever_stiffness"]
        forcing = -length * (s["lever_mass_position"] * s["lever_mass"] + m_p) * cosine
        _, expected = signal.freqs([forcing], [inertia, damping, stiffness], 2 * np.pi * frequency)
        expected *= 180.0 / np.pi
        np.testing.assert_allclose(z[:, index], np.abs(expected), rtol=1e-4)
    magnitude, phase = (np.array(curve) for curve in slice_of[-1]["data"]["y"][4:6])  # at the end, as the last above
    np.testing.assert_allclose(magnitude, np.abs(expected), rtol=1e-3)
    np.testing.assert_allclose(np.exp(1j * np.radians(phase)), expected / np.abs(expected), atol=2e-3)
    assert phase[0] > -200.0
    assert phase[-1] < -320.0
    shown = np.array([step["data"]["y"][column] for step in slice_of for column in (4, 6)], dtype=float)
    span = 10.0 ** np.array(figures(page)["figure-slices"]["layout"]["yaxis"]["range"])
    assert span == pytest.approx([0.8 * np.nanmin(shown), 1.25 * np.nanmax(shown)], rel=0.01)


def test_the_band_of_the_feedthrough_is_what_was_sent(page: Reader, result: SimulationResult) -> None:
    """At the end of the run, at the frequencies that are sent: those of the slider's grid that are whole."""
    figure = figures(page)["figure-slices"]
    step = figure["choices"]["of"][-1]
    curves = dict(zip((f"{name}{k}" for k, name in enumerate(("low", "high") * 2)), step["data"]["y"], strict=False))
    grid = unpack(traces(page, "figure-slices", "estimate ± 2σ")[0]["x"])
    assert (grid[0], grid[-1]) == (2.0, 8.0)
    for place, frequency in enumerate(grid):
        sent = np.flatnonzero(result.trace["feedthrough_frequency_Hz"] == frequency)
        if sent.size:
            gain, phase = (result.trace[f"feedthrough_{name}"][sent[-1]] for name in ("gain_sigma", "phase_sigma_rad"))
            assert np.log(curves["high1"][place] / curves["low0"][place]) == pytest.approx(4.0 * gain, abs=2e-3)
            width = curves["high3"][place] - curves["low2"][place]
            assert np.radians(width) == pytest.approx(4.0 * phase, abs=5e-3)
    assert step["traces"] == list(range(8))  # band and curves, not the coherence
    caption = "".join(page.text)
    held = re.search(r"held the true magnitude ([\d.]+) % and the true phase ([\d.]+) % of the time", caption)
    assert held is not None
    assert all(80 < float(share) <= 100 for share in held.groups())


def test_coherence_is_that_of_the_measured_signals(page: Reader, result: SimulationResult) -> None:
    signal = pytest.importorskip("scipy.signal")
    (trace,) = traces(page, "figure-slices", "measured coherence")
    frequency, coherence = unpack(trace["x"]), unpack(trace["y"])
    assert (frequency[0], frequency[-1]) == pytest.approx((0.5, 12.0), abs=0.51)
    assert frequency[0] == pytest.approx(0.5)
    inside = [np.where(np.isfinite(c), c, np.nanmean(c)) for c in (result.trace[name] for name in COHERENT)]
    expected_frequency, expected = signal.coherence(*inside, 1000.0, nperseg=2000)
    np.testing.assert_allclose(coherence, np.interp(frequency, expected_frequency, expected), atol=0.02)
    windows = len(inside[0]) // 1000 - 1
    (chance,) = traces(page, "figure-slices", "95 % of chance alone")
    np.testing.assert_allclose(unpack(chance["y"]), 1.0 - 0.05 ** (1.0 / (windows - 1)), rtol=1e-6)
    assert "complex error was" in "".join(page.text)


def test_spectra_are_those_of_scipy_and_the_natural_frequency_is_marked(page: Reader, result: SimulationResult) -> None:
    signal = pytest.importorskip("scipy.signal")
    for name, column in (("base acceleration z̈", "z_ddot_true_m_s2"), ("motor torque τ<sub>m</sub>", "tau_m_true_N_m")):
        (trace,) = traces(page, "figure-spectra", name)
        x, y = unpack(trace["x"]), unpack(trace["y"])
        frequency, power = signal.welch(result.trace[column], 1e3, "hann", 4000)
        np.testing.assert_allclose(y, np.sqrt(np.interp(x, frequency, power)), rtol=1e-3)
        assert (x[0], x[-1]) == pytest.approx((0.25, 50.0), abs=0.26)
    layout, truth = figures(page)["figure-spectra"]["layout"], result.trace["natural_frequency_true_Hz"]
    (box,), (words,) = layout["shapes"], layout["annotations"]
    assert (box["x0"], box["x1"]) == pytest.approx((truth.min(), truth.max()))
    assert 10.0 ** words["x"] == pytest.approx(np.sqrt(truth.min() * truth.max()))
    for row in ("yaxis", "yaxis2"):
        low, high = layout[row]["range"]
        assert 0.0 < high - low < 4.3


def test_overview_of_the_motion_keeps_the_extremes(page: Reader, result: SimulationResult) -> None:
    trace = traces(page, "figure-motion", "truth")[0]
    theta = np.degrees(result.trace["theta_true_rad"])
    y = unpack(trace["y"])
    assert (y.min(), y.max()) == (pytest.approx(theta.min(), rel=1e-6), pytest.approx(theta.max(), rel=1e-6))


def test_close_ups_show_one_stretch_at_a_time(page: Reader) -> None:
    figure = figures(page)["figure-detail"]
    buttons = figure["choices"]["of"]
    assert [button["label"] for button in buttons] == ["start", "first change", "end"]
    for button in buttons:
        begin, end = button["layout"]["xaxis.range"]
        for visible, trace in zip(button["data"]["visible"], figure["data"], strict=True):
            x = unpack(trace["x"])
            assert visible == (begin - 1e-3 < x.min() and x.max() < end + 1e-3)
    colours = {trace["name"]: (trace.get("line") or trace["marker"])["color"] for trace in figure["data"]}
    assert colours == {"measured": "@measured", "truth": "@truth", "estimate": "@estimate"}


def test_innovations_are_averages_and_the_band_knows_of_missing_outputs(page: Reader, result: SimulationResult) -> None:
    trace = traces(page, "figure-innovations", "average over 0.25 s")[0]
    nis, theta = result.trace["nis"][4000:4250], result.trace["theta_measured_rad"][4000:4250]
    outputs = np.isfinite(theta).astype(int) + np.isfinite(result.trace["theta_dot_measured_rad_s"][4000:4250])
    used = nis > 0.0
    middle = np.flatnonzero(np.isclose(unpack(trace["x"]), 4.1245, atol=1e-3))[0]
    assert unpack(trace["y"])[middle] == pytest.approx(nis[used].sum() / outputs[used].sum(), rel=1e-5)
    upper = traces(page, "figure-innovations", "95 % if σ is right")[1]
    x, height = unpack(upper["x"]), unpack(upper["y"])
    assert height[np.abs(x - 12.5) < 0.3].min() > height[np.abs(x - 5.0) < 0.3].max()  # one output: more scatter


def test_the_correlation_of_the_residual_is_that_of_the_summary(page: Reader, result: SimulationResult) -> None:
    stated = result.summary.whiteness
    assert stated is not None
    bars = traces(page, "figure-whiteness", "residual of the rate")[0]
    np.testing.assert_allclose(unpack(bars["y"]), stated.autocorrelation, rtol=1e-6)
    assert unpack(bars["x"]) == pytest.approx(20.0 * np.arange(1, 26))
    lower, upper = (unpack(trace["y"]) for trace in traces(page, "figure-whiteness", "chance alone"))
    assert (lower[0], upper[0]) == pytest.approx((-stated.band_of_all, stated.band_of_all))
    values = {row[0]: row[1] for row in page.tables[2][1:]}
    assert float(values["largest correlation of residuals"]) == pytest.approx(stated.largest, rel=5e-3)
    assert ("are white" in "".join(page.text)) == (max(map(abs, stated.autocorrelation)) <= upper[0])


def test_health_names_what_happened_when_it_happened(page: Reader) -> None:
    bars = {trace["name"]: trace for trace in figures(page)["figure-health"]["data"]}
    assert {"mode: align", "mode: run", "fault: theta", "fault: theta_dot", "lost"} <= set(bars)
    assert "fault: recovered" not in bars
    x = unpack(bars["fault: theta"]["x"]).reshape(-1, 3)
    longest = x[np.argmax(x[:, 1] - x[:, 0])]
    assert longest[0] == pytest.approx(12.0, abs=0.05)
    assert longest[1] == pytest.approx(13.0, abs=0.05)
    assert enum_words("lever_fault")["theta"] in bars["fault: theta"]["hovertemplate"]


# --- less than everything --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("missing", ["estimate", "sigma", "measured", "true", "theta", "nis", "mode", "excitation"])
def test_any_missing_column_costs_only_its_figure(missing: str, result: SimulationResult, tmp_path: Path) -> None:
    trace = {name: column for name, column in result.trace.items() if missing not in name}
    write_report(trace, result.summary, tmp_path / "report.html")
    page = read(tmp_path / "report.html")
    assert "explained" in page.ids("section")
    assert set(figures(page)) <= set(FIGURES)
    assert page.ids("div") == list(figures(page))


def test_a_run_that_got_no_answer_still_has_a_report(result: SimulationResult, tmp_path: Path) -> None:
    silent = ("estimate", "sigma", "nis", "mode", "faults", "lost", "corrupt", "late", "excitation")
    trace = {
        name: np.full(len(column), np.nan) if any(word in name for word in silent) else column
        for name, column in result.trace.items()
    }
    write_report(trace, result.summary, tmp_path / "report.html")
    assert "figure-excitation" in figures(read(tmp_path / "report.html"))


def test_two_samples_are_enough(result: SimulationResult, tmp_path: Path) -> None:
    write_report({name: column[:2] for name, column in result.trace.items()}, None, tmp_path / "report.html")
    assert "excitation" in read(tmp_path / "report.html").ids("section")


def test_a_path_that_cannot_be_written_is_one_line(result: SimulationResult, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(LeverError, match="cannot write"):
        write_report(result.trace, result.summary, tmp_path / "file" / "report.html")
    assert [entry.name for entry in tmp_path.iterdir()] == ["file"]


# --- cost ------------------------------------------------------------------------------------------------------------


def test_a_longer_run_makes_no_larger_page(report: Path, result: SimulationResult, tmp_path: Path) -> None:
    """Three minutes at 1 kHz."""
    count = len(result.trace["time_s"])
    times = 180_000 // count + 1
    trace = {name: np.tile(column, times) for name, column in result.trace.items()}
    trace["time_s"] = np.arange(count * times, dtype=np.float64) / 1e3
    write_report(trace, result.summary, tmp_path / "long.html")
    assert (tmp_path / "long.html").stat().st_size < 2.7e6
    assert report.stat().st_size < 2.7e6


def test_nothing_slow_is_imported() -> None:
    """Neither scipy nor plotly's Python classes: each takes longer than all the rest."""
    code = """
import sys, numpy as np, lever_cdkf.report.page
from lever_cdkf.report import write_report
slow = {"scipy", "pandas", "plotly.graph_objs", "plotly.io", "matplotlib", "cantools"} & set(sys.modules)
sys.exit(f"imports {slow}" if slow else 0)
"""
    subprocess.run([sys.executable, "-c", code], check=True)


# --- in a browser ----------------------------------------------------------------------------------------------------


@BROWSER
def test_the_picture_for_a_readme_is_a_png(report: Path, tmp_path: Path) -> None:
    assert screenshot.main([str(report), str(tmp_path / "picture.png")]) == 0
    head = (tmp_path / "picture.png").read_bytes()[:24]
    assert head[:8] == b"\x89PNG\r\n\x1a\n"
    assert struct.unpack(">II", head[16:]) == screenshot.SIZE
    assert [entry.name for entry in tmp_path.iterdir()] == ["picture.png"]


def test_no_picture_without_a_report(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert screenshot.main([str(tmp_path / "none.html"), str(tmp_path / "picture.png")]) == 2
    assert "no such report" in capsys.readouterr().err
