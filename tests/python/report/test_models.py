"""Reports of other models than the lever, and of a truth that is not of the estimator's model."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from lever_cdkf.report import write_report
from lever_sil.plants import pilots
from lever_sil.run.runner import SimulationResult
from scipy import signal

from .conftest import run
from .reading import Reader, figures, read, unpack


def page_of(result: SimulationResult, folder: Path) -> Reader:
    write_report(result.trace, result.summary, folder / "report.html")
    return read(folder / "report.html")


@pytest.fixture(scope="module")
def black_box(tmp_path_factory: pytest.TempPathFactory) -> tuple[SimulationResult, Reader]:
    result = run("linear_black_box", "duration=6 s", "converged_after=1 s", "limits={}")
    return result, page_of(result, tmp_path_factory.mktemp("black_box"))


@pytest.fixture(scope="module")
def mismatch(tmp_path_factory: pytest.TempPathFactory) -> Reader:
    """Return the lever as truth, a linear estimator."""
    overrides = ("duration=6 s", "converged_after=1 s", "limits={}", "estimator.model=linear_black_box")
    return page_of(run("base_only", *overrides), tmp_path_factory.mktemp("mismatch"))


def curves(page: Reader, figure: str, name: str) -> list[np.ndarray]:
    return [unpack(trace["y"]) for trace in figures(page)[figure]["data"] if trace["name"] == name]


def test_signed_parameters_are_shown_with_their_symbols_and_not_cut_at_zero(
    black_box: tuple[SimulationResult, Reader],
) -> None:
    result, page = black_box
    rows = [row[0] for row in page.tables[1][1:]]
    assert rows[:3] == ["a21 minus stiffness", "a22 minus damping", "b21 answer to the floor"]
    titles = [figures(page)["figure-parameters"]["layout"][axis]["title"]["text"] for axis in ("yaxis", "yaxis2")]
    assert titles == ["a<sub>21</sub> [1/s²]", "a<sub>22</sub> [1/s]"]
    lower, upper = curves(page, "figure-parameters", "estimate ± 2σ")[:2]
    assert upper.max() < 0.0
    sigma = result.trace["a21_sigma_1_s2"]
    assert (upper - lower).min() == pytest.approx(4.0 * np.nanmin(sigma), rel=0.01)
    assert "three numbers of any second-order system" in "".join(page.text)


def test_the_answer_of_the_black_box_is_that_of_scipy(black_box: tuple[SimulationResult, Reader]) -> None:
    result, page = black_box
    heat = figures(page)["figure-map-estimate"]["data"][0]
    time, frequency, z = (unpack(heat[axis]) for axis in "xyz")
    at = int(np.searchsorted(result.trace["time_s"], time[-1] - 5e-4))
    a21, a22, b21 = (result.trace[name][at] for name in ("a21_estimate_1_s2", "a22_estimate_1_s", "b21_estimate"))
    _, expected = signal.freqs([b21], [1.0, -a22, -a21], 2 * np.pi * frequency)
    np.testing.assert_allclose(z[:, -1], np.degrees(np.abs(expected)), rtol=1e-4)


def test_a_linear_system_that_moves_along_with_the_floor_starts_at_phase_zero(tmp_path: Path) -> None:
    page = page_of(run("linear_physical", "duration=4 s", "converged_after=1 s", "limits={}"), tmp_path)
    steps = figures(page)["figure-slices"]["choices"]["of"]
    phase = steps[-1]["data"]["y"][5]  # after the band
    assert -30.0 < phase[0] < 0.0
    assert -180.0 < phase[-1] < -120.0


def test_another_kind_of_truth_is_said_to_be_one_and_compared_where_it_can_be(mismatch: Reader) -> None:
    text = "".join(mismatch.text)
    assert "The truth of this run is of another kind: a rigid lever with the arm as mass" in text
    assert "They have no true values" in text
    assert [row[0] for row in mismatch.tables[1][1:]] == ["fn natural frequency", "ζ damping ratio"]
    assert curves(mismatch, "figure-parameters", "truth") == []
    assert len(curves(mismatch, "figure-dynamics", "truth")) == 2
    heat = figures(mismatch)["figure-map-truth"]["data"][0]
    frequency, z = unpack(heat["y"]), unpack(heat["z"])
    cosine, arm = np.cos(np.radians(20.0)), 0.45**2
    inertia, damping = arm * (0.3 + 1.8) + 0.02, arm * 32.0 * cosine**2 + 0.5  # the pilot of base_only
    stiffness = arm * 1150.0 * cosine**2 + 5.0
    _, expected = signal.freqs([-0.45 * (0.6 + 1.8) * cosine], [inertia, damping, stiffness], 2 * np.pi * frequency)
    np.testing.assert_allclose(z[:, -1], np.degrees(np.abs(expected)), rtol=1e-4)


def test_every_model_of_the_truth_has_words(tmp_path: Path) -> None:
    assert all(kind.about for kind in pilots.MODELS.values())
    page = page_of(run("mayo_ectomorphic", "duration=6 s", "converged_after=2 s", "limits={}"), tmp_path)
    text = "".join(page.text)
    assert "a hand that follows the cabin as Mayo (1989) measured it" in text
    assert "poles of the hand's transfer function" in text
    assert "Residuals of the rate are coloured" in text


def test_without_a_summary_the_model_is_that_of_the_columns(
    black_box: tuple[SimulationResult, Reader], tmp_path: Path
) -> None:
    result, _ = black_box
    trace = {name: column for name, column in result.trace.items() if "_true" not in name}
    write_report(trace, None, tmp_path / "replay.html")
    page = read(tmp_path / "replay.html")
    assert len(curves(page, "figure-parameters", "estimate")) == 3
    assert "a21 minus stiffness" in "".join(page.text)
