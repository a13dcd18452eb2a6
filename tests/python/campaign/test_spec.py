"""Specs of campaigns: what they say, what is refused, and the points of their designs."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from lever_sil.campaign import design, spec
from lever_sil.campaign.entrants import ENTRANTS
from lever_sil.campaign.spec import Spec
from lever_sil.toml_tables import ScenarioError

SpecOf = Callable[[str], Spec]

HEAD = 'title = "made"\nscenario = "steady"\nset = { duration = "2 s", converged_after = "1 s" }\n'
NOISE = '[[vary]]\nkey = "pilot.process_noise"\n'
LOG = NOISE + 'range = ["0.01 rad/s/sqrt(s)", "1 rad/s/sqrt(s)"]\nscale = "log"\n'
PROGRESS = NOISE.replace("process", "progress") + 'values = ["1 rad", "2 rad"]\n'
THETA = '[[vary]]\nkey = "sensors.theta.noise"\nvalues = ["1 mrad", "2 mrad"]\n'


def test_a_grid_goes_through_all_values_the_last_axis_fastest(spec_of: SpecOf) -> None:
    grid = spec_of(HEAD + THETA + LOG + "steps = 3\n")
    points = [design.columns(grid, design.point(grid, number)) for number in range(grid.size)]
    assert [tuple(point.values()) for point in points] == [
        (1.0, 0.01), (1.0, 0.1), (1.0, 1.0), (2.0, 0.01), (2.0, 0.1), (2.0, 1.0),
    ]  # fmt: skip
    assert [axis.unit for axis in grid.vary] == ["mrad", "rad/s/sqrt(s)"]


def test_what_goes_with_an_axis_moves_in_its_own_range(spec_of: SpecOf) -> None:
    text = 'steps = 3\nalso = { "settings.theta_dot_process_noise" = ["0.02 rad/s/sqrt(s)", "2 rad/s/sqrt(s)"] }\n'
    flight = (grid := spec_of(HEAD + LOG + text)).flight(design.point(grid, 1), 7)
    assert flight.pilot.process_noise == pytest.approx(0.1)
    assert flight.config.settings["theta_dot_process_noise"] == pytest.approx(0.2)
    assert (flight.seed, flight.duration) == (7, 2.0)


def test_a_latin_hypercube_has_one_point_in_each_part_of_each_axis(spec_of: SpecOf) -> None:
    text = HEAD + 'design = "latin_hypercube"\npoints = 50\n' + LOG
    text += '[[vary]]\nkey = "sensors.theta.noise"\nrange = ["1 mrad", "3 mrad"]\n'
    hypercube = spec_of(text)
    points = [design.columns(hypercube, design.point(hypercube, number)) for number in range(50)]
    noise = np.log10([float(point["pilot.process_noise"]) for point in points]) / 2.0 + 1.0
    theta = (np.array([float(point["sensors.theta.noise"]) for point in points]) - 1.0) / 2.0
    for positions in (noise, theta):
        assert sorted((50.0 * positions).astype(int)) == list(range(50))
    assert abs(np.corrcoef(noise, theta)[0, 1]) < 0.5  # each in an order of its own


def test_random_points_are_the_same_every_time_and_each_its_own(spec_of: SpecOf) -> None:
    random = spec_of(HEAD + 'design = "random"\npoints = 1000000000\n' + LOG + THETA)
    numbers = (0, 1, 999_999_999)
    points = [design.point(random, number) for number in numbers]
    assert points == [design.point(random, number) for number in numbers]
    assert len({str(point) for point in points}) == 3


def test_a_table_can_be_set(spec_of: SpecOf) -> None:
    text = HEAD.replace("set = { ", 'set = { "pilot.k_p" = { kind = "ramp", first = "1500 N/m", last = "1800 N/m", '
                        'start = "1 s", duration = "1 s" }, ')  # fmt: skip
    truth = (flight := spec_of(text).first).truth(flight.time())
    assert truth.parameters["k_p"][[0, -1]] == pytest.approx([1500.0, 1800.0], abs=1.0)


def test_the_hash_is_of_what_makes_rows(spec_of: SpecOf, tmp_path: Path) -> None:
    first = spec_of(HEAD + LOG + "steps = 3\n")
    same = spec_of('description = "in other words"\nchunk = 3\n' + HEAD.replace("made", "called") + LOG + "steps = 3\n")
    assert same.hashed == first.hashed
    (tmp_path / "own.toml").write_bytes(first.content + b"\n")
    others = (
        HEAD + LOG + "steps = 4\n",
        "seeds = 2\n" + HEAD + LOG + "steps = 3\n",
        HEAD.replace("2 s", "3 s") + LOG + "steps = 3\n",
        HEAD.replace("steady", "own.toml") + LOG + "steps = 3\n",
    )
    assert len({first.hashed, *(spec_of(text).hashed for text in others)}) == 5


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "key 'title' is missing"),
        (HEAD.replace("steady", "stead"), "no scenario 'stead'"),
        (HEAD + 'estimators = ["dual", "jont"]\n', "estimators: 'jont' is not known; allowed: dual, joint"),
        (HEAD + "points = 5\n", "points: a grid has as many as its axes"),
        (HEAD + 'design = "random"\n', "points: how many"),
        (HEAD + LOG, "steps: how many values"),
        (HEAD + LOG + 'steps = 3\nvalues = ["1 rad/s/sqrt(s)"]\n', "give either values or a range"),
        (HEAD + NOISE + 'range = ["1 mrad", "2 rad"]\nsteps = 2\n', "two quantities in the same unit"),
        (HEAD + LOG.replace("0.01", "0") + "steps = 2\n", "above 0"),
        (HEAD + LOG + 'steps = 2\nalso = { "settings.theta_noise" = ["1 mrad"] }\n', "has 1 values and"),
        (HEAD + THETA + THETA, "sensors.theta.noise is set twice"),
        (
            HEAD + NOISE + 'values = ["1 rad", "2 rad"]\n',
            "made.toml: vary[0]: pilot.process_noise: '1 rad' has unit 'rad'",
        ),
        (HEAD + PROGRESS, "made.toml: vary[0]: pilot: unknown key 'progress_noise'"),
        (HEAD + PROGRESS.replace("progress", "hand.progress"), "made.toml: vary[0]: pilot: unknown key 'hand'"),
        (HEAD + PROGRESS.replace("pilot", "title"), "made.toml: vary[0]: title.progress_noise="),
        (
            HEAD + THETA + 'also = { "sensors.z_ddot.noise" = ["1 rad", "2 rad"] }\n',
            "vary[0].also: sensors.z_ddot.noise: '1 rad'",
        ),
        (HEAD.replace("2 s", "2 m"), "made.toml: set: duration: '2 m' has unit 'm'"),
        (
            HEAD + THETA.replace('"1 mrad", "2 mrad"', '"-1 mrad", "-2 mrad"'),
            "made.toml: vary[0]: sensors.theta.noise: '-1 mrad'",
        ),
        (HEAD.replace("2 s", "1 s"), "made.toml: set: duration: in 1 s no estimate is judged"),
        (HEAD.replace(', converged_after = "1 s"', ""), "from converged_after on, which is 20 s"),
        ('every = "3 s"\n' + HEAD, "in 2 s no estimate is judged: one every 3 s"),
        ('every = "1.5 ms"\n' + HEAD, "made.toml: every: 0.0015 s is no multiple of the sample period of 0.001 s"),
        (
            HEAD + THETA + 'name = "noise"\n' + LOG + 'steps = 2\nname = "noise"\n',
            "vary: two axes have the name 'noise'",
        ),
        (HEAD + '[[vary]]\nkey = "estimator.model"\nvalues = ["lever", "linear_physical"]\n', "one estimator.model"),
        (HEAD.replace("steady", "sensor_dropout") + 'estimators = ["rls"]\n', "rls needs every sample"),
        (HEAD.replace("steady", "fixed_preload") + 'estimators = ["joint_ekf"]\n', "joint_ekf needs preload trim"),
    ],
)
def test_what_is_refused(text: str, says: str, spec_of: SpecOf, tmp_path: Path) -> None:
    with pytest.raises(ScenarioError) as refused:
        spec_of(text)
    assert says in str(refused.value)
    assert str(refused.value).startswith(f"{tmp_path}/made.toml: ")


def test_what_cannot_be_at_one_end_of_an_axis_is_said_and_left_to_its_runs(spec_of: SpecOf) -> None:
    """Even at the first point, of which all else is taken."""
    values = 'values = ["-1 mrad", "1 mrad"]\n'
    refused = spec_of(HEAD + THETA.replace('values = ["1 mrad", "2 mrad"]\n', values) + LOG + "steps = 2\n")
    (doubt,) = refused.doubts
    assert "made.toml: vary[0]: sensors.theta.noise: '-1 mrad' is out of range" in doubt
    assert refused.first.sensors.theta.noise == pytest.approx(1e-3)
    preload = '[[vary]]\nkey = "estimator.preload"\nvalues = ["trim", "fixed"]\n'
    (doubt,) = spec_of('estimators = ["dual", "rls"]\n' + HEAD + preload).doubts
    assert "estimators: rls needs preload trim" in doubt
    assert spec_of(HEAD + THETA).doubts == ()


def test_a_flight_that_can_be_is_found_between_the_ends(spec_of: SpecOf) -> None:
    """Of an axis neither end of which can be."""
    values = 'values = ["-1 mrad", "-2 mrad", "1 mrad", "-3 mrad"]\n'
    spread = spec_of(HEAD + THETA.replace('values = ["1 mrad", "2 mrad"]\n', values))
    assert spread.first.sensors.theta.noise == pytest.approx(1e-3)


@pytest.mark.parametrize("name", spec.names())
def test_shipped_specs(name: str) -> None:
    shipped = spec.load(name)
    last = shipped.flight(design.point(shipped, shipped.size - 1), shipped.seed)
    last.check()
    assert shipped.description


def test_the_map_of_tracking_has_a_hundred_thousand_runs_of_a_minute() -> None:
    tracking = spec.load("tracking")
    assert tracking.runs >= 100_000
    assert tracking.first.duration == 60.0


def test_the_page_names_every_estimator_and_no_other(root: Path) -> None:
    page = (root / "sil/lever_sil/campaign/README.md").read_text(encoding="utf-8")
    (row,) = (line for line in page.splitlines() if line.startswith("| `estimators` |"))
    assert set(re.findall(r"`(\w+)`", row.split("|")[2])) == set(ENTRANTS)
