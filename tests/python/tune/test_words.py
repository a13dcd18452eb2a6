"""What is said of a log that was tuned on: figures by their definitions, verdicts, tables and the page."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from lever_cdkf.firmware.innovations import INNOVATION
from lever_cdkf.report.figure import Spec
from lever_cdkf.tune import tune_page, validation
from lever_cdkf.tune.calibration import Calibrated, _sentences
from lever_cdkf.tune.search import Tuned
from lever_cdkf.tune.validation import Fit
from python.report.reading import Reader, figures, read, unpack

PERIOD = 1e-3


def fit(
    settings: str,
    noise: str = "as set",
    part: str = "held out",
    level: float = 0.0,
    scatter: float = 0.1,
    scale: float = 1.0,
) -> Fit:
    """Return a fit of 10 s whose log-likelihood is `level` but for noise, and its innovations `scale` sigma."""
    rng = np.random.default_rng(3)
    rows = np.zeros(10_000, INNOVATION)
    rows["log_likelihood"] = level + (scatter * rng.standard_normal(10_000) if level else 0.0)
    rows["sigma"] = (2e-3, 0.04)
    rows["value"] = scale * rows["sigma"] * rng.standard_normal((10_000, 2))
    rows["nis"] = np.square(rows["value"] / rows["sigma"]).sum(axis=1)
    rows["size"] = 2
    return Fit(settings, noise, part, rows, PERIOD)


def test_figures_of_a_fit_by_their_definitions() -> None:
    found = fit("before", level=2.5, scale=1.5)
    assert found.log_likelihood == pytest.approx(2.5, abs=0.01)
    assert found.nis == pytest.approx(2.25, rel=0.05)  # a mean of the outputs, not their sum
    found.innovations["size"][:5000], found.innovations["nis"][:5000] = 0, 0.0  # nothing was compared
    assert found.nis == pytest.approx(2.25, rel=0.05)
    nothing = fit("before")
    nothing.innovations["size"] = 0
    nothing.innovations["nis"] = 0.0
    assert nothing.nis == 0.0
    measured = found.correlation
    assert measured is not None
    assert abs(found.largest_correlation or 1.0) == round(float(np.abs(measured.autocorrelation).max()), 3)


def test_a_rate_that_is_seldom_measured_has_no_correlation() -> None:
    found = fit("before")
    found.innovations["sigma"][:, 1] = 0.0
    assert found.correlation is None
    assert found.largest_correlation is None


def test_before_and_after_are_paired_by_noise_and_part() -> None:
    ways = [(noise, part) for noise in ("as set", "estimated") for part in ("tuned on", "held out")]
    all_fits = [fit(settings, *way) for settings in ("before", "after") for way in ways]
    found = validation.pairs(all_fits)
    assert [(before.noise, before.part) for before, _ in found] == ways
    assert all(b.settings == "before" and a.settings == "after" for b, a in found)
    assert all((b.noise, b.part) == (a.noise, a.part) for b, a in found)


def test_a_gain_says_its_error() -> None:
    assert str(validation.Gain(0.12345, 0.01234)) == "+0.1235 ± 0.0123 nat a sample"
    assert str(validation.Gain(-2.0, 0.5)) == "-2.0000 ± 0.5000 nat a sample"


def test_a_part_of_one_block_has_no_error_and_decides_nothing() -> None:
    short = fit("after", level=5.0)
    few = Fit("after", "as set", "held out", short.innovations[:900], PERIOD)
    gained = validation.gain(Fit("before", "as set", "held out", fit("before").innovations[:900], PERIOD), few)
    assert gained.mean == pytest.approx(5.0, abs=0.05)
    assert math.isinf(gained.error)
    assert not gained.is_better
    assert not gained.is_worse


@pytest.mark.parametrize(
    ("fits", "changed", "said"),
    [
        ([], 0, "The log contradicts none of the settings: nothing to tune."),
        (
            [fit("before", part="tuned on"), fit("after", part="tuned on")],
            1,
            "1 setting changed. Nothing was held out.",
        ),
        (
            [fit("before"), fit("after", level=1.0), fit("before", "estimated"), fit("after", "estimated", level=-1.0)],
            3,
            "3 settings changed. On the part not tuned on: better with noise as set (+",
        ),
    ],
)
def test_the_verdict(fits: list[Fit], changed: int, said: str) -> None:
    words = validation.verdict(fits, changed)
    assert words.startswith(said)
    if len(fits) == 4:
        assert "); worse with noise estimated while running (-" in words
        assert words.endswith(" nat a sample).")


def test_what_counts_is_noise_as_in_flight() -> None:
    """Estimated while running, where the settings say so: the last that is compared."""
    worse, better = fit("after", level=-1.0), fit("after", "estimated", level=1.0)
    before = [fit("before"), fit("before", "estimated")]
    assert validation.is_worse([before[0], worse])
    assert not validation.is_worse([*before, worse, better])
    assert not validation.is_worse([fit("before", part="tuned on"), fit("after", part="tuned on", level=-1.0)])
    assert not validation.is_worse([])


def test_the_calibration_in_words() -> None:
    found = Calibrated("z_ddot_gain", 1.0, 0.05, 1.0234, 0.0045, white=True)
    delay = Calibrated("z_ddot_delay", 0.0, 1e-4, 0.0002, 3e-4, white=True)
    words = _sentences((found, delay), 0.02)
    assert words.startswith(
        "From the dither (± one standard deviation): z_ddot_gain 1.023 ± 0.0045, "
        "z_ddot_delay 0.0002 ± 0.0003 s (kept: the log does not determine it better). tau_m_gain cannot be found"
    )
    assert "Its standard deviation of 2 % is part of these." in words


# --- the page --------------------------------------------------------------------------------------------------------

TUNED = (
    Tuned("theta_noise", before=1e-3, best=5e-4, low=4e-4, high=6e-4),
    Tuned("m_p_walk", before=0.01, best=0.001, low=None, high=0.004),
    Tuned("k_p_walk", before=0.02, best=0.02, low=0.01, high=None),
)
CONTENT: dict[str, list[dict[str, str | float | None]]] = {
    "settings": [{"name": "theta_noise", "unit": "rad", "before": 1e-3, "after": 5e-4}],
    "before and after": [{"part": "held out", "noise": "as set", "gain [nat]": 0.5}],
}


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Reader:
    path: Path = tmp_path_factory.mktemp("page") / "tune.html"
    fits = [fit(settings, part=part) for settings in ("before", "after") for part in ("tuned on", "held out")]
    path.write_text(tune_page.build("log <a>", "it is <b>", CONTENT, "gain & delay", TUNED, fits), encoding="utf-8")
    return read(path)


def title(spec: Spec, row: str) -> str:
    return str(spec["layout"][row]["title"]["text"])


def test_the_page_has_its_sections_and_says_all_words_as_text(page: Reader) -> None:
    text = "".join(page.text)
    for words in ("log <a>", "it is <b>", "gain & delay", "Calibration", "What the log says of the settings"):
        assert words in text
    assert text.count("Before and after") >= 2  # in the table of contents, and over the section
    assert page.tables[0][0] == ["name", "unit", "before", "after"]
    assert page.tables[0][1][:2] == ["theta_noise", "rad"]
    assert page.tables[1][1][:2] == ["held out", "as set"]
    assert [heading for heading in ("settings", "before and after", "calibration") if heading in page.text] == [
        "settings",
        "before and after",
    ]


def test_axes_of_the_page(page: Reader) -> None:
    drawn = figures(page)
    assert list(drawn) == ["intervals", "sizes", "correlation"]
    assert title(drawn["intervals"], "xaxis") == "value ÷ value before"
    assert drawn["intervals"]["layout"]["xaxis"]["type"] == "log"
    lanes = drawn["intervals"]["layout"]["yaxis"]
    assert (lanes["tickvals"], lanes["ticktext"]) == ([0, 1, 2], ["k_p_walk", "m_p_walk", "theta_noise"])
    assert lanes["range"] == pytest.approx([-0.6, 2.6])
    assert title(drawn["sizes"], "xaxis") == "time in this part [s]"
    assert (title(drawn["sizes"], "yaxis"), title(drawn["sizes"], "yaxis2")) == ("θ [1]", "θ̇ [1]")
    assert title(drawn["correlation"], "xaxis") == "lag [s]"
    assert title(drawn["correlation"], "yaxis") == "autocorrelation [1]"
    assert page.captions[1].startswith("Innovations of the part held out, over what the filter predicts of them")
    assert page.captions[2].startswith("Autocorrelation of the innovations of θ̇ on the part held out")


def test_an_interval_without_an_end_goes_ten_times_beyond_the_last_value(page: Reader) -> None:
    bars = [t for t in figures(page)["intervals"]["data"] if t["name"] == "not contradicted"]
    expected = [(0.5, 10.0), (0.04, 0.4), (0.4, 0.6)]  # of the value before; the lowest lane first
    for bar, ends in zip(bars, expected, strict=True):
        assert unpack(bar["x"]) == pytest.approx(ends, rel=1e-4)


def test_innovations_and_their_correlation_are_those_of_the_part_held_out(page: Reader) -> None:
    drawn = figures(page)
    sizes = drawn["sizes"]["data"]
    assert [trace["name"] for trace in sizes] == ["before", "before", "after", "after"]
    for trace in sizes:
        assert unpack(trace["x"]) == pytest.approx(np.arange(10) + 0.5)
        assert unpack(trace["y"]) == pytest.approx(1.0, abs=0.1)
    low, high, before, after = drawn["correlation"]["data"]
    measured = fit("before").correlation
    assert measured is not None
    assert unpack(high["y"]) == pytest.approx(measured.band_95, rel=1e-4)
    assert unpack(low["y"]) == pytest.approx(-measured.band_95, rel=1e-4)
    assert high["name"] == "white noise, 95 %"
    assert unpack(after["y"]) == pytest.approx(measured.autocorrelation, abs=1e-4)
    assert (before["name"], after["name"]) == ("before", "after")


def test_without_a_setting_or_a_rate_there_is_no_chart(tmp_path: Path) -> None:
    without = fit("before")
    without.innovations["sigma"][:, 1] = 0.0
    (tmp_path / "x.html").write_text(tune_page.build("", "", {}, "", (), [without]), encoding="utf-8")
    assert list(figures(read(tmp_path / "x.html"))) == ["sizes"]
