"""Maps: cells against polars, the border against one that is known, the files."""

from __future__ import annotations

import csv
import math
import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import polars
import pytest
from lever_sil.campaign import border, cells, chunks, maps, spec
from lever_sil.campaign.cells import Map, Runs
from lever_sil.campaign.chunks import Plan
from lever_sil.campaign.spec import Failure
from lever_sil.study.figures.maps import Line, Scale, across
from python.campaign.conftest import SMALL
from python.conftest import Refused, Run

NOISE = (0.01, 0.1, 1.0, 10.0)
LIMITS = Failure(error=0.2, coverage=0.8)


def runs(error: np.ndarray, coverage: float = 1.0) -> Runs:
    count = len(error)
    nothing = np.full(count, np.nan)
    return Runs(error, np.full((count, 3), coverage), nothing, nothing, nothing, np.zeros(count, dtype=np.bool_))


def row_of(columns: list[Runs]) -> Map:
    one, of_dual = Scale("", ("",)), {(0, 0, x): each for x, each in enumerate(columns)}
    return Map(one, one, Scale("noise", NOISE, is_log=True), ("m_p",), {"dual": of_dual})


def test_the_border_lies_between_cells_as_far_as_the_logarithms_say() -> None:
    (found,) = border.borders(row_of([runs(np.full(9, error)) for error in (0.025, 0.05, 0.8, 0.9)]), LIMITS)
    assert found.at == pytest.approx(10.0**-0.5)  # 0.2 is halfway from 0.05 to 0.8
    assert [found.low, found.high] == pytest.approx([found.at, found.at])
    assert found.cause == "error"


@pytest.mark.parametrize(
    ("errors", "covered", "at", "cause"),
    [
        ((0.1, 0.1, 0.1, 0.1), (1.0, 1.0, 1.0, 1.0), math.inf, ""),
        ((0.3, 0.1, 0.1, 0.1), (1.0, 1.0, 1.0, 1.0), -math.inf, "error"),
        ((0.1, 0.1, 0.1, 0.1), (1.0, 0.9, 0.7, 0.5), 10.0**-0.5, "coverage"),
        ((0.1, 0.1, np.inf, 0.1), (1.0, 1.0, 1.0, 1.0), 0.1, "error"),
        ((0.1, 0.1, 0.1, 0.1), (np.nan,) * 4, math.inf, ""),
    ],
)
def test_borders_at_the_edges(errors: tuple[float, ...], covered: tuple[float, ...], at: float, cause: str) -> None:
    columns = [runs(np.full(5, error), share) for error, share in zip(errors, covered, strict=True)]
    (found,) = border.borders(row_of(columns), LIMITS)
    assert found.at == pytest.approx(at)
    assert found.cause == cause


def test_the_band_holds_the_border_of_the_population() -> None:
    """Errors are log-normal about a median that grows by the logarithm: the border is known. Of 40 campaigns a band of
    95 % holds it in 38, and in fewer than 34 with a probability of 0.1 %."""
    rng = np.random.default_rng(3)
    held = 0
    for _ in range(40):
        medians = np.array([0.02, 0.08, 0.32, 1.28])
        columns = [runs(median * np.exp(0.5 * rng.standard_normal(60))) for median in medians]
        (found,) = border.borders(row_of(columns), LIMITS)
        known = 0.1 * 10.0 ** (math.log(0.2 / 0.08) / math.log(4.0))
        held += found.low <= known <= found.high
        assert found.high / found.low < 4.0
    assert held >= 34


@pytest.fixture(scope="session")
def folder(small: Plan, undisturbed: dict[str, bytes], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the files of the small campaign."""
    place = tmp_path_factory.mktemp("small")
    for name, content in undisturbed.items():
        (place / name).write_bytes(content)
    return place


def test_cells_are_what_polars_says(small: Plan, folder: Path) -> None:
    found = cells.read(small, folder)
    assert (found.y.values, found.x.values) == ((0.02, 0.2, 0.3), ("fixed", "robbins_monro"))
    parameters = [polars.col(f"rms_{name}") for name in ("m_p", "c_p", "k_p")]
    rows = polars.read_parquet(folder / "*.parquet").with_columns(polars.max_horizontal(parameters).alias("worst"))
    for name in small.spec.estimators:
        errors, covered = (found.array(name, 0, statistic) for statistic in (cells.error, cells.coverage))
        for y, noise in enumerate(found.y.values):
            for x, adaptation in enumerate(found.x.values):
                here = (polars.col("estimator") == name) & (polars.col("pilot.process_noise") == noise)
                own = rows.filter(here & (polars.col("estimator.adaptation") == adaptation))
                assert len(own) == 4
                assert errors[y, x] == pytest.approx(own["worst"].median())
                shares = own.select(f"coverage_{parameter}" for parameter in ("m_p", "c_p", "k_p")).to_numpy()
                assert covered[y, x] == pytest.approx(shares.mean(axis=0).min())


def test_a_run_whose_error_is_no_number_has_diverged(small: Plan, folder: Path, tmp_path: Path) -> None:
    """Estimates of 1e200 are finite, and their squares are not."""
    for file in folder.glob("*.parquet"):
        polars.read_parquet(file).with_columns(polars.lit(None, polars.Float64).alias("rms_c_p")).write_parquet(
            tmp_path / file.name
        )
    found = cells.read(small, tmp_path)
    for name in small.spec.estimators:
        assert np.all(found.array(name, 0, cells.error) == np.inf)
        assert np.all(found.array(name, 0, cells.coverage) == 0.0)


@pytest.fixture(scope="session")
def made_map(tmp_path_factory: pytest.TempPathFactory) -> tuple[Plan, Path, Sequence[str]]:
    """Return the same with the axes the other way round, one flight at each point, and the files of its maps."""
    place = tmp_path_factory.mktemp("map")
    head, noise, adaptation = (
        SMALL.replace("seeds = 4", "seeds = 1").replace("chunk = 1", "chunk = 6").split("[[vary]]")
    )
    (place / "swapped.toml").write_text(f"{head}[[vary]]{adaptation}[[vary]]{noise}")
    plan = Plan(spec.load(str(place / "swapped.toml")))
    (place / "swapped.toml").unlink()
    chunks.make(plan, plan.chunk(0), place)
    return plan, place, maps.write(plan, place)


def test_no_map_over_names(small: Plan, folder: Path) -> None:
    assert maps.write(small, folder) == ()


def test_files(made_map: tuple[Plan, Path, Sequence[str]]) -> None:
    plan, place, written = made_map
    assert {file.name for file in place.iterdir() if file.suffix != ".parquet"} == set(written)
    page = (place / "map.html").read_text()
    for title in ("Error", "Coverage", "NEES", "Settling", "Where tracking fails"):
        assert f"<h2>{title}</h2>" in page
    assert ElementTree.parse(place / "map.svg").getroot().tag.endswith("svg")
    rows = list(csv.DictReader((place / "border.csv").read_text().splitlines()))
    assert [row["estimator"] for row in rows] == ["dual", "dual", "rls", "rls"]
    assert all(float(row["low"]) <= float(row["high"]) for row in rows)
    before = {name: (place / name).read_bytes() for name in written}
    maps.write(plan, place)
    assert {name: (place / name).read_bytes() for name in written} == before


def test_figures_of_a_campaign_are_made_from_its_folder_alone(
    made_map: tuple[Plan, Path, Sequence[str]], lever: Run, tmp_path: Path
) -> None:
    plan, place, _ = made_map
    names = ("map_error", "map_coverage")
    spec.save(plan.spec, place)
    try:
        assert lever("figures", "--campaign", place, "--only", *names, "--out", tmp_path)[0] == 0
    finally:
        (place / spec.FILE).unlink()
    written = {file.name for file in tmp_path.iterdir()}
    assert written >= {f"{name}.{kind}" for name in names for kind in ("pdf", "svg", "png", "csv")}
    assert 'id="map_error"' in (tmp_path / "figures.html").read_text()
    table = list(csv.DictReader((tmp_path / "map_error.csv").read_text().splitlines()))
    rows = polars.read_parquet(place / "*.parquet")
    for row in rows.iter_rows(named=True):
        where = {"chart": row["estimator"], "series": "", "estimator.adaptation": row["estimator.adaptation"]}
        where["pilot.process_noise [rad/s/sqrt(s)]"] = f"{row['pilot.process_noise']}"
        (cell,) = [each for each in table if where.items() <= each.items()]
        worst = max(row["rms_m_p"], row["rms_c_p"], row["rms_k_p"])
        assert float(cell["value"]) == pytest.approx(100.0 * worst)
    lines = [[row["value"], row["low"], row["high"]] for row in table if row["series"] == "border"]
    borders = csv.DictReader((place / "border.csv").read_text().splitlines())
    at = "pilot.process_noise [rad/s/sqrt(s)]"
    assert lines == [[row[at], row["low"], row["high"]] for row in borders]


def test_what_is_no_folder_of_a_campaign_has_no_figures(refused: Refused, tmp_path: Path) -> None:
    assert "is not the folder of a campaign" in refused("figures", "--campaign", tmp_path, "--out", tmp_path / "out")


def test_of_a_border_beyond_the_map_only_the_band_is_drawn_to_the_edge() -> None:
    scale = Scale("noise", NOISE, is_log=True)
    low, at, high = np.array([-np.inf, 0.1, 0.2]), np.array([-np.inf, 0.1, np.inf]), np.array([0.05, 0.1, np.inf])
    drawn = np.exp(across(scale, Line((0, 1, 2), at, low, high)))
    expected = np.array(((0.01, 0.1, 0.2), (np.nan, 0.1, np.nan), (0.05, 0.1, 10.0)))
    assert drawn == pytest.approx(expected, nan_ok=True)
