"""Rows of runs: against `lever sim`, against the textbook, however they are grouped, and of runs that fail."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from lever_cdkf.errors import LeverError
from lever_cdkf.firmware.native import run_samples
from lever_sil.campaign import chunks, figures, runs, summary
from lever_sil.campaign.chunks import Chunk, Plan
from lever_sil.campaign.entrants import ENTRANTS, Track
from lever_sil.campaign.flight import simulate
from lever_sil.campaign.session import Session
from lever_sil.campaign.spec import Spec
from lever_sil.run import runner
from lever_sil.scenarios import scenario

SpecOf = Callable[[str], Spec]

ONE = 'title = "one"\nscenario = "steady"\nevery = "0.02 s"\nset = { duration = "20 s", converged_after = "8 s" }\n'


def test_a_run_is_that_of_lever_sim(spec_of: SpecOf) -> None:
    """But for what frames round: noise is not estimated, as its rules have thresholds that rounding may tip."""
    without = ONE.replace(" }", ', "settings.noise_window" = "0 s" }')
    (row,) = runs.rows(spec_of("seed = 5\n" + without), range(1))
    changes = ["duration=20 s", "converged_after=8 s", "settings.noise_window=0 s", "seed=5"]
    summary = runner.simulate(scenario.load("steady", changes)).summary
    for name, quality in summary.parameters.items():
        assert 100.0 * row[f"rms_{name}"] == pytest.approx(quality.rms_percent, rel=0.02)  # frames round
        assert 100.0 * row[f"bias_{name}"] == pytest.approx(quality.bias_percent, abs=0.05)
        assert row[f"coverage_{name}"] == pytest.approx(quality.coverage_2sigma, abs=0.02)
    settled = summary.parameters["natural_frequency"].time_to_5_percent_s[0]
    assert row["settled_s"] == pytest.approx(settled, abs=0.05)
    assert row["nis"] == pytest.approx(summary.nis.mean, rel=0.1)  # of every twentieth sample
    assert row["flagged"] == pytest.approx(summary.flagged_share, abs=0.01)
    assert row["seed"] == 5


SPIKES = 'sensors.theta.fault=[{kind="spikes", start="1 s", end="2 s", share="5 %", size="50 mrad"}]'


BEYOND = "pilot.process_noise=1e4 rad/s/sqrt(s)"  # what a frame can carry


@pytest.mark.parametrize("changes", [[], [SPIKES], [BEYOND]])
def test_what_was_measured_makes_the_firmware_say_the_same_to_the_bit(changes: list[str]) -> None:
    steady = scenario.load("steady", ["duration=3 s", "converged_after=1 s", "limits={}", *changes])
    flight = simulate(steady, 0.1, measured=True)
    time_us = np.arange(3000) * 1000
    replayed = run_samples(steady.config, {"time_us": time_us, **flight.measured}, flight.at)
    for name in ("parameter", "parameter_sigma", "nis", "faults"):
        np.testing.assert_array_equal(replayed[name], flight.firmware[name], err_msg=name)


def test_figures_of_errors_that_are_known(spec_of: SpecOf) -> None:
    """Parameters 1, 2 and 3 standard deviations off, each relative to a truth of its own, NEES by hand."""
    flight = simulate(spec_of(ONE).first, 1.0, measured=False)
    times = len(flight.at)
    sigma = np.array([0.05, 0.05, 0.05, 0.01, 0.02])
    off = np.array([1.0, 2.1, -3.0, 0.0, 1.0]) * sigma
    values = flight.truth * (1.0 + off)
    scaled = np.log(values[:, :3])
    track = Track(
        values[None], (sigma * flight.truth)[None], scaled[None],
        np.tile(np.diag(sigma[:3] ** 2), (1, times, 1, 1)), np.full((1, times), 2.0),
    )  # fmt: skip
    found = figures.of_run(flight, track, 0)
    assert [found[f"rms_{name}"] for name in ("m_p", "c_p", "k_p")] == pytest.approx([0.05, 0.105, 0.15])
    assert [found[f"bias_{name}"] for name in ("m_p", "c_p", "k_p")] == pytest.approx([0.05, 0.105, -0.15])
    assert [found[f"coverage_{name}"] for name in ("m_p", "c_p", "k_p", "damping_ratio")] == [1.0, 0.0, 0.0, 1.0]
    assert found["nees"] == pytest.approx(np.sum((np.log1p(off[:3]) / sigma[:3]) ** 2))
    assert (found["nis"], found["settled_s"], found["flagged"]) == (2.0, 0.0, None)
    for wrong in (np.nan, -np.inf, 1e160):  # the square of the last overflows
        broken = values.copy()
        broken[5:] = wrong
        with pytest.raises(figures.BrokenDownError, match="from 5 s on"):
            figures.of_run(flight, dataclasses.replace(track, values=broken[None]), 0)


def test_times_without_a_truth_are_not_judged(spec_of: SpecOf) -> None:
    """As with hands off. By `lever sim`, too, error and coverage are of the others."""
    flight = simulate(spec_of(ONE).first, 1.0, measured=False)
    truth = flight.truth.copy()
    truth[15:, :3] = np.nan
    values = flight.truth * 1.1
    track = Track(values[None], 0.1 * flight.truth[None], np.log(values[None, :, :3]), None, None)
    found = figures.of_run(dataclasses.replace(flight, truth=truth), track, 0)
    assert found["rms_m_p"] == pytest.approx(0.1)
    assert found["coverage_m_p"] == 1.0
    truth[:] = np.nan
    found = figures.of_run(dataclasses.replace(flight, truth=truth), track, 0)
    assert (found["rms_m_p"], found["bias_m_p"], found["coverage_m_p"]) == (None, None, None)


@pytest.mark.parametrize("name", ENTRANTS)
def test_every_estimator_follows_a_steady_pilot(name: str, spec_of: SpecOf) -> None:
    (row,) = runs.rows(spec_of(f'estimators = ["{name}"]\n' + ONE), range(1))
    assert "error" not in row
    assert row["rms_natural_frequency"] < 0.1
    assert (row["coverage_k_p"] is None) == (name == "lms")


def test_rows_do_not_depend_on_how_flights_are_grouped(small: Plan) -> None:
    """Baselines excepted, which are run side by side within a chunk: chunks are the same everywhere."""
    firmware = dataclasses.replace(small.spec, estimators=("dual", "joint"))
    together = list(runs.rows(firmware, range(3, 7)))
    assert together == [row for flight in range(3, 7) for row in runs.rows(firmware, range(flight, flight + 1))]
    assert [row["run"] for row in together] == list(range(6, 14))


def test_a_run_that_cannot_be_is_a_row_with_its_error(spec_of: SpecOf, tmp_path: Path) -> None:
    text = '[[vary]]\nkey = "settings.theta_noise"\nvalues = ["1 mrad", "-1 mrad", "2 mrad"]\n'
    text += '[[vary]]\nkey = "estimator.preload"\nvalues = ["trim", "fixed"]\n'
    plan = Plan(spec_of('estimators = ["dual", "rls"]\n' + ONE.replace("20 s", "2 s").replace("8 s", "1 s") + text))
    assert chunks.make(plan, Chunk(0, 4), tmp_path) == 8
    rows = pq.read_table(tmp_path / Chunk(0, 4).name(plan.fingerprint)).to_pylist()
    assert [row["error"] is not None for row in rows] == [False, False, False, True, True, True, True, True]
    assert rows[3]["error"].startswith("rls needs preload trim")
    assert rows[4]["error"].startswith("ScenarioError: vary[0]: settings: theta_noise = -0.001 is out of range")
    assert rows[4]["rms_m_p"] is None
    assert (rows[4]["run"], rows[4]["seed"], rows[4]["settings.theta_noise"]) == (4, 3, -1.0)


def test_chunks_cover_all_flights_once(small: Plan) -> None:
    for flights in (1, 5, 7, 24, 100):
        plan = Plan(dataclasses.replace(small.spec, chunk=flights))
        covered = [flight for number in range(plan.count) for flight in range(*_ends(plan.chunk(number)))]
        assert covered == list(range(24))


def test_a_chunk_is_about_a_second_of_work(small: Plan) -> None:
    """So that a campaign that is killed after some seconds has kept something."""
    for estimators in (("dual", "joint"), ("dual", "rls"), ("dual", "joint", "joint_ekf", "rls")):
        plan = Plan(dataclasses.replace(small.spec, chunk=None, estimators=estimators))
        assert plan.size * plan.minutes * 0.035 * len(estimators) == pytest.approx(1.0, rel=0.3)


def _ends(chunk: Chunk) -> tuple[int, int]:
    return chunk.first, chunk.end


def test_what_is_done_is_what_is_whole(small: Plan, tmp_path: Path) -> None:
    assert small.done(tmp_path) == set()
    for number in (2, 5, 7):
        chunks.make(small, small.chunk(number), tmp_path)
    damaged = tmp_path / small.chunk(5).name(small.fingerprint)
    damaged.write_bytes(damaged.read_bytes()[:-20])
    (tmp_path / small.chunk(7).name(small.fingerprint)).write_bytes(b"")
    (tmp_path / f".{small.chunk(9).name(small.fingerprint)}.1.tmp").touch()
    assert small.done(tmp_path) == {2}


def test_another_library_makes_another_campaign(small: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "other").write_bytes(b"another build")
    monkeypatch.setattr(chunks, "native_file", lambda name: tmp_path / "other")
    chunks._code.cache_clear()
    try:
        assert chunks.fingerprint(small.spec) != small.fingerprint
    finally:
        chunks._code.cache_clear()


def test_another_campaign_in_the_folder_is_refused(small: Plan, tmp_path: Path) -> None:
    chunks.make(small, small.chunk(0), tmp_path)
    for other in (dataclasses.replace(small.spec, seeds=5), dataclasses.replace(small.spec, chunk=3)):
        with pytest.raises(LeverError, match="give another folder"):
            Plan(other).done(tmp_path)


def test_rows_have_the_columns_of_the_readme(small: Plan, tmp_path: Path) -> None:
    chunks.make(small, small.chunk(0), tmp_path)
    (file,) = tmp_path.iterdir()
    schema = pq.read_schema(file)
    figures_of = [f"{what}_{name}" for name in ("m_p", "c_p", "k_p", "natural_frequency", "damping_ratio")
                  for what in ("rms", "bias", "coverage")]  # fmt: skip
    numbers, axes = ["run", "point", "seed"], ["pilot.process_noise", "estimator.adaptation"]
    judged = [*figures_of, "nees", "nis", "settled_s", "flagged"]
    assert schema.names == [*numbers, "estimator", *axes, *judged, "error"]
    types = {name: str(schema.field(name).type) for name in schema.names}
    assert {types[name] for name in numbers} == {"int64"}
    assert {types[name] for name in (*judged, axes[0])} == {"double"}
    assert {types[name] for name in ("estimator", axes[1], "error")} == {"string"}
    assert schema.field(axes[0]).metadata == {b"unit": b"rad/s/sqrt(s)"}
    assert schema.field(axes[1]).metadata == {b"unit": b"1"}
    assert not any(schema.field(name).nullable for name in (*numbers, "estimator"))
    assert schema.metadata == {b"lever_campaign": small.fingerprint.encode(), b"title": b"small"}
    assert file.name == f"{small.fingerprint}-0000000000-0000000000.parquet"
    first, second = pq.read_table(file).to_pylist()
    assert [(row["run"], row["point"], row["seed"], row["estimator"]) for row in (first, second)] == [
        (0, 0, 1, "dual"), (1, 0, 1, "rls")
    ]  # fmt: skip
    assert first["flagged"] is not None
    assert second["flagged"] is None, "of the firmware only"


def test_what_is_summed_up_of_a_campaign_is_what_its_rows_say(small: Plan, tmp_path: Path) -> None:
    for number in range(4):
        chunks.make(small, small.chunk(number), tmp_path)
    rows = [row for file in sorted(tmp_path.glob("*.parquet")) for row in pq.read_table(file).to_pylist()]
    built = summary.build(small, tmp_path, Session(runs=8, seconds=0.5))
    assert built == {
        "title": "small", "campaign": small.fingerprint, "asked": 48, "runs": 8, "failed": 0,
        "minutes_a_run": pytest.approx(1.0 / 60.0), "real_time_factor_per_core": 16.0,
    }  # fmt: skip
    assert summary.build(small, tmp_path, Session())["real_time_factor_per_core"] is None
    for line, name in zip(summary.by_estimator(small, tmp_path), ("dual", "rls"), strict=True):
        own = [row for row in rows if row["estimator"] == name]
        assert (line["estimator"], line["runs"], line["failed"]) == (name, 4, 0)
        quantities = ("m_p", "c_p", "k_p", "natural_frequency", "damping_ratio")
        for each in quantities:
            assert line[f"{each} rms [%]"] == pytest.approx(
                100.0 * np.median([row[f"rms_{each}"] for row in own]), abs=0.006
            )
        least = min(np.mean([row[f"coverage_{each}"] for row in own]) for each in quantities)
        assert line["least coverage [%]"] == pytest.approx(100.0 * least, abs=0.006)
    assert summary.errors(tmp_path) == []
