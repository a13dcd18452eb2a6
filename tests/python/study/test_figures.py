"""What the figures show and what their captions say, against the runs computed anew: the estimator sample by sample,
the lever's equation written out, scipy's integration, roots and chi-square."""

from __future__ import annotations

import functools
import math
import re
from typing import Any

import numpy as np
import pytest
from lever_cdkf.errors import LeverError
from lever_cdkf.firmware.config import settings_table
from lever_cdkf.firmware.native import Config, Estimator
from lever_sil.study.data import Batch
from lever_sil.study.figures import catalogue, runs
from lever_sil.study.figures.description import LOOKS, Band, Curve, Points, Row, Surface, Trace, number
from lever_sil.study.firmware import EXACT
from lever_sil.study.matched import Condition, jump, matched, tightened
from numpy.typing import NDArray
from python.study.shown import SEED, SHORT, figure_of
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.stats import chi2

Array = NDArray[Any]  # of floats
DEFAULTS = {row.name: row.default for row in settings_table()}
MATCHED = {"change_threshold": 0.0, "noise_window": 0.0, "align_time": 0.0}
PRIOR = {"m_p_sigma": 0.25, "c_p_sigma": 0.3, "k_p_sigma": 0.3}
LINEAR = {"m_sigma": 0.25, "c_sigma": 0.3, "k_sigma": 0.3, "lever_preload_angle": 0.0}
NOISY = Condition("linear_physical", "fixed", dither_rms=2.0, settings={**LINEAR, "theta_dot_process_noise": 0.1})
every = pytest.mark.parametrize("name", catalogue.FIGURES)


def rows(name: str, column: int = 0) -> dict[str, Row]:
    content = figure_of(name).columns[column].content
    assert not isinstance(content, Surface)
    return {row.label: row for row in content}


def trace(row: Row, name: str) -> Any:
    return next(found for found in row.traces if found.name == name)


def two(value: float, digits: int = 2) -> str:
    """As a caption writes a number; none here needs an exponent or has more than three digits before the point."""
    return f"{float(f'{value:.{digits}g}'):g}"


def values(entry: Trace) -> tuple[Array, ...]:
    return (entry.low, entry.high) if isinstance(entry, Band) else (entry.y,)


def by_sample(config: Config, batch: Batch, run: int = 0) -> list[Any]:
    """Estimates after each sample of a run, through the interface that takes one sample at a time."""
    estimator, found = Estimator(config), []
    for k, ((theta, rate), (z_ddot, tau_m)) in enumerate(zip(batch.raw_y[run], batch.raw_u[run], strict=True)):
        estimator.update(k * 1000, theta=theta, theta_dot=rate, tau_m=tau_m, z_ddot=z_ddot)
        found.append(estimator.estimate())
    return found


# --- all figures -----------------------------------------------------------------------------------------------------


@every
def test_every_axis_has_a_unit_and_every_series_is_drawn_within_its_time(name: str) -> None:
    figure = figure_of(name)
    for column in figure.columns:
        if isinstance(column.content, Surface):
            assert column.content.label.endswith("[deg per m/s²]")
            continue
        for row in column.content:
            assert re.fullmatch(r".+ \[[^\]]+\]", row.label)
            for entry in row.traces:
                assert entry.look in LOOKS
                assert np.all(np.diff(entry.x) > 0.0)
                assert entry.x[-1] == pytest.approx(figure.x_range[1], abs=2e-3)
                for series in values(entry):
                    assert series.shape == entry.x.shape
                    assert np.isfinite(series).all()
                if isinstance(entry, Band):
                    assert np.all(entry.low <= entry.high)


@every
def test_charts_hold_all_that_is_drawn_once_the_start_is_over(name: str) -> None:
    figure = figure_of(name)
    for column in figure.columns:
        if isinstance(column.content, Surface):
            continue
        for row, (low, high) in zip(column.content, figure.limits(), strict=True):
            for entry in row.traces:
                after = entry.x >= max(figure.x_range[0], figure.scaled_from)
                assert all(low <= series[after].min() <= series[after].max() <= high for series in values(entry))


def test_series_that_share_a_chart_do_not_rely_on_hue() -> None:
    for name in catalogue.FIGURES:
        for column in figure_of(name).columns:
            if isinstance(column.content, Surface):
                continue
            for row in column.content:
                lines = [entry for entry in row.traces if isinstance(entry, Curve)]
                looks = {(LOOKS[entry.look].colour, LOOKS[entry.look].dash) for entry in lines}
                assert len({dash for _, dash in looks}) >= min(2, len(looks)), (name, row.label)
                assert len(looks) == len(lines)


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [(0.0123, 2, "0.012"), (1234.0, 2, "1,200"), (99.96, 3, "100"), (0.00005, 2, "0.00005"), (-2.0, 2, "-2")],
)
def test_numbers_have_the_digits_that_count_and_no_exponent(value: float, digits: int, text: str) -> None:
    assert number(value, digits) == text


def test_names_are_put_in_order_and_unknown_ones_refused() -> None:
    known = list(catalogue.FIGURES)
    assert catalogue.chosen(["grip", "bode"], known) == ["bode", "grip"]
    assert catalogue.chosen([], known) == known
    with pytest.raises(LeverError, match=r"unknown figure 'body'; did you mean bode\?"):
        catalogue.chosen(["grip", "body"], known)
    with pytest.raises(LeverError, match=r"unknown figure 'xyz'; there are bode, excitation"):
        catalogue.chosen(["xyz"], known)


# --- Bode ------------------------------------------------------------------------------------------------------------


def lever_terms(p: Array) -> tuple[float, float, float, float]:
    """Inertia, damping, stiffness and forcing of the lever of firmware/THEORY.md about where p holds it."""
    s, g = DEFAULTS, 9.80665
    m_p, c_p, k_p = p.tolist()
    length, moment = s["lever_length"], s["lever_mass_position"] * s["lever_mass"] + m_p

    def torque(theta: float) -> float:
        arm = length**2 * k_p * (math.sin(theta) - math.sin(s["arm_preload_angle"])) * math.cos(theta)
        own = s["lever_stiffness"] * (theta - s["lever_preload_angle"])
        return float(g * length * moment * math.cos(theta) + arm + own)

    rest: float = brentq(torque, -1.0, 1.0, xtol=1e-12)
    slope = (torque(rest + 1e-5) - torque(rest - 1e-5)) / 2e-5
    inertia = length**2 * (s["lever_mass_position"] ** 2 * s["lever_mass"] + m_p) + s["lever_inertia"]
    damping = c_p * length**2 * math.cos(rest) ** 2 + s["lever_damping"]
    return inertia, damping, slope, length * moment * math.cos(rest)


def test_the_surfaces_are_the_answer_of_the_linearised_lever() -> None:
    walks = {"m_p_walk": 0.01, "c_p_walk": 0.06, "k_p_walk": 0.06}
    batch = matched(Condition("lever", "fixed", settings={**PRIOR, **walks}), 1, 3.0 * SHORT.duration, SEED)
    found = by_sample(Config("lever", "fixed", "dual", "fixed", settings={**PRIOR, **walks, **MATCHED}), batch)
    truth, estimate = (column.content for column in figure_of("bode").columns)
    assert isinstance(truth, Surface)
    assert isinstance(estimate, Surface)
    assert truth.magnitude.shape == estimate.magnitude.shape == (len(truth.frequency), len(truth.time))
    assert batch.truth.p is not None
    for index in (0, 100, len(truth.time) - 1):
        k = round(truth.time[index] / batch.period)
        for surface, p in ((truth, batch.truth.p[0, k]), (estimate, np.array(found[k].parameter))):
            inertia, damping, stiffness, forcing = lever_terms(p)
            s = 2j * np.pi * surface.frequency
            answer = np.degrees(np.abs(forcing / (inertia * s**2 + damping * s + stiffness)))
            np.testing.assert_allclose(surface.magnitude[:, index], answer, rtol=1e-5)
            s = 2j * np.pi * surface.ridge[index]
            there = np.degrees(np.abs(forcing / (inertia * s**2 + damping * s + stiffness)))
            assert surface.ridge_magnitude[index] == pytest.approx(there, rel=2e-3)  # between two frequencies
            natural = math.sqrt(stiffness / inertia) / (2.0 * np.pi)
            # The firmware linearises about the angle it measures, not about the one that its parameters would hold.
            assert surface.ridge[index] == pytest.approx(natural, rel=1e-5 if surface is truth else 3e-3)
        assert estimate.ridge[index] == found[k].natural_frequency
    peaks = [max(at_once) for at_once in truth.magnitude.T]
    sentence = f"the peak is between {number(min(peaks))} and {number(max(peaks))} deg per m/s²"
    assert sentence in figure_of("bode").caption


# --- linear models ---------------------------------------------------------------------------------------------------


def test_without_process_noise_the_response_is_that_of_the_equation() -> None:
    """x_ddot = -(k/m) x - (c/m) x_dot + z_ddot + f/m, integrated by scipy over the excerpt that is shown."""
    batch, chart = matched(NOISY, 1, SHORT.duration, SEED), rows("excitation")
    position, rate = (trace(chart[label], "without process noise") for label in ("x [mm]", "ẋ [mm/s]"))
    time = np.arange(batch.samples) * batch.period
    assert batch.truth.p is not None
    columns = np.concatenate((batch.truth.p[0], batch.u[0]), axis=1)

    def slope(t: float, x: Array) -> tuple[float, float]:
        m, c, k, z_ddot, force = (np.interp(t, time, column) for column in columns.T)
        return x[1], -(k / m) * x[0] - (c / m) * x[1] + z_ddot + force / m

    start = (position.y[0] * 1e-3, rate.y[0] * 1e-3)
    span, at = (position.x[0], position.x[-1]), position.x[::50]
    found = solve_ivp(slope, span, start, t_eval=at, rtol=1e-7, atol=1e-9, max_step=0.01).y * 1e3
    assert np.abs(found[0] - position.y[::50]).max() < 0.02 * np.abs(position.y).max()
    assert np.abs(found[1] - rate.y[::50]).max() < 0.02 * np.abs(rate.y).max()


def test_excitation_and_response_are_those_of_the_run() -> None:
    batch, chart = matched(NOISY, 1, SHORT.duration, SEED), rows("excitation")
    window = slice(batch.samples - 2000, None)
    for label, column in (("z̈ [m/s²]", 0), ("f [N]", 1)):
        np.testing.assert_array_equal(trace(chart[label], "truth").y, batch.u[0, window, column])
    for label, state in (("x [mm]", 0), ("ẋ [mm/s]", 1)):
        np.testing.assert_allclose(trace(chart[label], "truth").y, 1e3 * batch.truth.x[0, window, state])
        measured = trace(chart[label], "measured")
        assert isinstance(measured, Points)
        np.testing.assert_allclose(measured.y, 1e3 * batch.raw_y[0, window, state])
    x, noise = batch.truth.x[0, :, 0], (batch.raw_y - batch.truth.x)[0, :, 0]
    caption = figure_of("excitation").caption
    assert f"moves by {two(1e3 * np.sqrt(np.mean(x**2)))} mm rms" in caption
    assert f"off by {two(1e3 * np.sqrt(np.mean(noise**2)))} mm rms" in caption
    assert "last 2 s" in caption


def test_states_are_those_of_the_firmware_and_the_caption_tells_their_errors() -> None:
    batch, chart, caption = matched(NOISY, 1, SHORT.duration, SEED), rows("states"), figure_of("states").caption
    config = Config("linear_physical", "fixed", "dual", "fixed", settings={**NOISY.settings, **MATCHED})
    found = by_sample(config, batch)
    half, window = slice(batch.samples // 2, None), slice(batch.samples - 2000, None)
    for state, name, symbol, unit in ((0, "theta", "x", "mm"), (1, "theta_dot", "ẋ", "mm/s")):
        truth, measured = 1e3 * batch.truth.x[0, :, state], 1e3 * batch.raw_y[0, :, state]
        estimate, sigma = (1e3 * np.array([getattr(e, name + end) for e in found]) for end in ("", "_sigma"))
        error, band = (trace(chart[f"error of {symbol} [{unit}]"], key) for key in ("estimate", "±2σ"))
        np.testing.assert_allclose(error.y, (estimate - truth)[window], atol=1e-9)
        np.testing.assert_allclose(band.high, 2.0 * sigma[window])
        np.testing.assert_allclose(band.low, -band.high)
        off, noise = (float(np.sqrt(np.mean((part - truth)[half] ** 2))) for part in (estimate, measured))
        inside = 100.0 * float(np.mean(np.abs(estimate - truth)[half] <= 2.0 * sigma[half]))
        assert f"{symbol} {two(off)} {unit} rms against {two(noise)} {unit}, {two(inside, 3)} % held" in caption


@pytest.mark.parametrize(
    ("model", "force", "settings", "labels"),
    [
        ("linear_physical", 2.0, LINEAR, {"m": "kg", "c": "N s/m", "k": "N/m"}),
        ("linear_black_box", 0.0, {"lever_preload_angle": 0.0}, {"a_21": "1/s²", "a_22": "1/s", "b_21": "1"}),
    ],
)
def test_linear_parameters_are_those_of_the_firmware(
    model: str, force: float, settings: dict[str, float], labels: dict[str, str]
) -> None:
    batch = matched(Condition(model, "fixed", dither_rms=force, settings=settings), 1, SHORT.duration, SEED)
    found = by_sample(Config(model, "fixed", "dual", "fixed", settings={**settings, **MATCHED}), batch)
    chart, caption = rows("parameters"), figure_of("parameters").caption
    assert batch.truth.p is not None
    for index, (symbol, unit) in enumerate(labels.items()):
        row = chart[f"{symbol} [{unit}]"]
        estimate, band, truth = (trace(row, name) for name in ("estimate", "estimate ± 2σ", "truth"))
        at = np.round(estimate.x / batch.period).astype(int)
        np.testing.assert_array_equal(truth.y, batch.truth.p[0, at, index])
        np.testing.assert_allclose(estimate.y, [found[k].parameter[index] for k in at])
        np.testing.assert_allclose((band.high - band.low) / 4.0, [found[k].parameter_sigma[index] for k in at])
        late = estimate.x >= estimate.x[-1] / 2.0
        off = float(np.sqrt(np.mean((estimate.y - truth.y)[late] ** 2)))
        share = 100.0 * float(np.mean((band.low <= truth.y) & (truth.y <= band.high)))
        printed_error = two(off) if unit == "1" else f"{two(off)} {unit}"
        assert f"{symbol} {printed_error} ({two(share, 3)} %)" in caption


# --- identification --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("column", "dither"), [(0, 0.0), (1, 0.4)])
def test_identification_shows_the_firmware_and_a_reference_that_starts_at_the_prior(column: int, dither: float) -> None:
    batch = matched(Condition("lever", "fixed", dither_rms=dither, settings=PRIOR), 1, SHORT.duration, SEED)
    chart = rows("identification", column)
    assert batch.truth.p is not None
    for estimator in ("dual", "joint"):
        found = by_sample(Config("lever", "fixed", estimator, "fixed", settings={**PRIOR, **MATCHED}), batch)
        for index, label in enumerate(("m_p [kg]", "c_p [N s/m]", "k_p [N/m]")):
            estimate, band = trace(chart[label], estimator), trace(chart[label], f"{estimator} ± 2σ")
            at = np.round(estimate.x / batch.period).astype(int)
            np.testing.assert_allclose(estimate.y, [found[k].parameter[index] for k in at])
            np.testing.assert_allclose((band.high - band.low) / 4.0, [found[k].parameter_sigma[index] for k in at])
            np.testing.assert_array_equal(trace(chart[label], "truth").y, batch.truth.p[0, at, index])
        frequency = trace(chart["f_n [Hz]"], estimator)
        np.testing.assert_allclose(frequency.y, [found[k].natural_frequency for k in at])
    for label, prior in (("m_p [kg]", 0.25), ("c_p [N s/m]", 0.3), ("k_p [N/m]", 0.3)):
        bound, truth = trace(chart[label], "linearised at the truth: ± 2σ"), trace(chart[label], "truth")
        relative = (bound.high - bound.low) / (4.0 * truth.y)
        assert relative[0] == pytest.approx(prior)
        assert relative[-1] < 0.7 * prior


# --- change of grip --------------------------------------------------------------------------------------------------


@functools.cache
def grips() -> tuple[Batch, Batch, int]:
    """Run before and after the grip tightens, and the sample at which it does."""
    condition = Condition("lever", "trim", dither_rms=0.4, settings=PRIOR)
    calm = matched(condition, SHORT.runs, SHORT.duration, SEED)
    moment = calm.samples // 2
    return calm, tightened(calm, jump(calm.samples, moment, np.array((1.0, 1.3, 1.3)))), moment


def test_a_tightened_grip_is_the_same_run_with_other_parameters() -> None:
    calm, tight, moment = grips()
    assert calm.truth.p is not None
    assert tight.truth.p is not None
    np.testing.assert_array_equal(tight.truth.x[:, : moment + 1], calm.truth.x[:, : moment + 1])
    np.testing.assert_allclose(tight.truth.p[:, moment:], calm.truth.p[:, moment:] * (1.0, 1.3, 1.3))
    np.testing.assert_allclose(tight.raw_y - tight.truth.x, calm.raw_y - calm.truth.x, atol=1e-12)
    kicks = []
    for batch in (calm, tight):
        assert batch.truth.p is not None
        mean = 0.5 * (batch.u[0, 1:] + batch.u[0, :-1]).T
        x, p = batch.truth.x[0], batch.truth.p[0]
        moved = batch.model.step(x[:-1].T, p[:-1].T, (mean[0], mean[1]), batch.trim[0, :-1], batch.period)
        kicks.append(x[1:] - moved.T)
    np.testing.assert_allclose(kicks[1], kicks[0], atol=1e-12)
    untouched = tightened(calm, np.ones((calm.samples, 3)))
    np.testing.assert_allclose(untouched.truth.x, calm.truth.x, atol=1e-12)
    m_p, _, k_p = tight.truth.p[0, -1]
    length, cosine = DEFAULTS["lever_length"], math.cos(math.radians(20.0))
    stiffness = (length * cosine) ** 2 * k_p + DEFAULTS["lever_stiffness"]
    own = DEFAULTS["lever_mass_position"] ** 2 * DEFAULTS["lever_mass"]
    expected = math.sqrt(stiffness / (length**2 * (own + m_p) + DEFAULTS["lever_inertia"])) / (2.0 * np.pi)
    assert tight.truth.dynamics[0, -1, 0] == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(("column", "title", "threshold"), [(0, "With detection", None), (1, "Without", 0.0)])
def test_the_grip_caption_tells_how_fast_the_runs_followed(column: int, title: str, threshold: float | None) -> None:
    _, batch, moment = grips()
    shown = rows("grip", column)["k_p [N/m]"]
    own = {} if threshold is None else {"change_threshold": threshold}
    config = Config("lever", "trim", "dual", "fixed", settings={**PRIOR, "noise_window": 0.0, **own})
    at = np.round(trace(shown, "truth").x / batch.period).astype(int)
    assert batch.truth.p is not None
    settled, inside, errors = [], [], []
    for run in range(batch.runs):
        found = by_sample(config, batch, run)
        estimate, sigma = (
            np.array([part[k] for k in at])
            for part in ([e.parameter[2] for e in found], [e.parameter_sigma[2] for e in found])
        )
        truth, elapsed = batch.truth.p[run, at, 2], (at - moment) * batch.period
        error = np.abs(estimate / truth - 1.0)
        errors.append(100.0 * error)
        outside = [t for t, e in zip(elapsed, error, strict=True) if t >= 0.0 and e > 0.1]
        later = elapsed[elapsed > max(outside, default=-1e-9)]
        settled.append(later[0] if later.size and later[0] >= 0.0 else math.inf)
        soon = (elapsed >= 0.0) & (elapsed < 2.0)
        inside += (np.abs(estimate - truth)[soon] <= 2.0 * sigma[soon]).tolist()
        if run == 0:
            np.testing.assert_allclose(trace(shown, "estimate").y, estimate)
    ends = (float(np.median(settled)), max(settled))
    seconds = [f"{two(time)} s" if math.isfinite(time) else "never" for time in ends]
    words = f"{title}, stiffness is within 10 % for good after {seconds[0]} (median; worst: {seconds[1]})"
    assert words in figure_of("grip").caption
    assert (
        f"the first 2 s the band holds it in {two(100.0 * float(np.mean(inside)))} % of the time"
        in figure_of("grip").caption
    )
    many = rows("grip", column)["k_p error [%]"]
    np.testing.assert_allclose(trace(many, "median of the runs").y, np.median(errors, axis=0), rtol=1e-6)


# --- consistency -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("case", "dither"), [("base only", 0.0), ("with dither", 0.4)])
def test_nees_is_that_of_the_firmwares_own_covariance(case: str, dither: float) -> None:
    batch = matched(Condition("lever", "fixed", dither_rms=dither, settings=PRIOR), SHORT.runs, SHORT.duration, SEED)
    row = rows("consistency")[f"NEES, {case} [1]"]
    mean = trace(row, "dual")
    at = np.round(mean.x / batch.period).astype(int)
    assert batch.truth.p is not None
    squares = np.zeros((batch.runs, len(at)))
    for run in range(batch.runs):
        config = Config("lever", "fixed", "dual", "fixed", settings={**EXACT, **PRIOR, **MATCHED})
        columns = runs.estimates(config, batch, run, at)
        error = np.log(columns["parameter"] / batch.truth.p[run, at])
        sigma = columns["parameter_sigma"] / columns["parameter"]
        for t, (r12, r13, r23) in enumerate(columns["parameter_correlation"]):
            correlation = np.array([[1.0, r12, r13], [r12, 1.0, r23], [r13, r23, 1.0]])
            covariance = correlation * np.outer(sigma[t], sigma[t])
            squares[run, t] = error[t] @ np.linalg.inv(covariance) @ error[t]
    np.testing.assert_allclose(mean.y, squares.mean(axis=0), rtol=1e-6)
    band = trace(row, "95 % by chance")
    low, high = chi2.ppf((0.025, 0.975), 3 * SHORT.runs) / SHORT.runs
    np.testing.assert_allclose(band.low, low, rtol=1e-9)
    np.testing.assert_allclose(band.high, high, rtol=1e-9)
    inside = 100.0 * np.mean((mean.y >= low) & (mean.y <= high))
    match = re.search(rf"{case}, dual: ([\d.]+) \(.*?\), ([\d.]+) %", figure_of("consistency").caption)
    assert match is not None
    assert match.groups() == (two(squares.mean(), 3), two(inside))
