"""Anybody's estimator in the comparison: runs as files, the three methods, and the example of PAPER.md."""

from __future__ import annotations

import hashlib
import json
import re
import sys
from collections.abc import Iterator
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet
import pytest
from lever_cdkf.cli.main import main
from lever_cdkf.errors import LeverError
from lever_cdkf.numeric.arrays import Array
from lever_sil.study.baselines import BASELINES
from lever_sil.study.candidate import Config, Sample, candidate
from lever_sil.study.compare import dataset, entrants, evaluation, run_cases
from lever_sil.study.compare.cases import Plan, cases
from lever_sil.study.data import Batch

PLAN = Plan(seeds=2, duration=1.5)
TRIM, FIXED, OTHER = "lever_trim_dither_rough", "lever_fixed_base_quiet", "step_up_black_box"


def arrays(batch: Batch) -> dict[str, Array]:
    own = {**asdict(batch.truth), **asdict(batch.knowledge)}
    own |= {name: getattr(batch, name) for name in ("y", "u", "trim", "raw_y", "raw_u", "period")}
    return {name: value for name, value in own.items() if value is not None}


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("data")
    assert list(dataset.write(folder, [TRIM, FIXED, OTHER], PLAN)) == [TRIM, FIXED, OTHER]
    return folder


@pytest.fixture(autouse=True)
def module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Yield the folder of a user, with an estimator that stays at the first guess, and one that breaks down
    half-way."""
    (tmp_path / "own_estimators.py").write_text(
        "import numpy as np\n"
        "class Guess:\n"
        "    def start(self, config): self.known, self.time = config.knowledge, 0.0\n"
        "    def step(self, sample): self.time = sample.time\n"
        "    def estimate(self): return self.known.guess, np.diag((self.known.sigma * self.known.guess) ** 2)\n"
        "class Breaks(Guess):\n"
        "    def step(self, sample):\n"
        "        if sample.time > 0.7: raise np.linalg.LinAlgError\n"
        "    def estimate(self): return self.known.guess, None\n"
        "class Short(Guess):\n"
        "    def estimate(self): return self.known.guess[:2], None\n"
        "class Half:\n"
        "    def start(self, config): pass\n",
        encoding="utf-8",
    )
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    yield
    entrants._CANDIDATES.clear()


@pytest.mark.parametrize("name", [TRIM, FIXED, OTHER])
def test_what_is_read_is_what_was_drawn_to_the_bit(name: str, files: Path) -> None:
    drawn, there = arrays(cases()[name].batch(PLAN)), arrays(dataset.read(files, name))
    assert drawn.keys() == there.keys()
    for key, values in drawn.items():
        np.testing.assert_array_equal(there[key], values, err_msg=key)
    plan, names = dataset.plan_of(files)
    assert (plan, names) == (replace(PLAN, data=str(files)), [TRIM, FIXED, OTHER])


def test_the_files_are_those_that_others_read(files: Path) -> None:
    """As PAPER.md says, and by the names that are in it: no estimator of another language has our code."""
    assert {path.name for path in files.iterdir()} == {
        "benchmark.json",
        *(f"{name}.parquet" for name in (TRIM, FIXED, OTHER)),
    }
    index = json.loads((files / "benchmark.json").read_text(encoding="utf-8"))
    assert index.keys() == {"format", "version", "seed", "seeds", "duration_s", "cases"}
    assert (index["format"], index["seed"], index["seeds"], index["duration_s"]) == (1, 1, 2, 1.5)
    known = index["cases"][TRIM]
    assert known.keys() == {"model", "preload", "period_s", "knowledge", "settings", "file", "sha256"}
    assert (known["model"], known["preload"], known["period_s"], known["file"]) == (
        "lever",
        "trim",
        1e-3,
        f"{TRIM}.parquet",
    )
    assert known["knowledge"].keys() == {"guess", "sigma", "walk", "positive", "output_noise", "process_noise"}
    assert known["settings"]["theta_dot_process_noise"] == 0.1
    assert (
        known["sha256"].removeprefix("sha256:") == hashlib.sha256((files / f"{TRIM}.parquet").read_bytes()).hexdigest()
    )
    table = parquet.read_table(files / f"{TRIM}.parquet")
    measured = ["theta_rad", "theta_dot_rad_s", "z_ddot_m_s2", "tau_m_N_m"]
    true = ["true_theta_rad", "true_theta_dot_rad_s", "true_natural_frequency_Hz", "true_damping_ratio"]
    assert table.column_names == ["run", "time_s", *measured, *true, "true_m_p", "true_c_p", "true_k_p"]
    batch = cases()[TRIM].batch(PLAN)
    rows = table.to_pandas()
    assert rows["run"].tolist() == [0] * 1500 + [1] * 1500
    np.testing.assert_allclose(rows["time_s"][1500:], 1e-3 * np.arange(1500))
    np.testing.assert_array_equal(rows[measured].to_numpy()[1500:], np.hstack((batch.raw_y[1], batch.raw_u[1])))
    np.testing.assert_array_equal(rows[true[:2]].to_numpy()[:1500], batch.truth.x[0])
    np.testing.assert_array_equal(rows[true[2:]].to_numpy()[:1500], batch.truth.dynamics[0])
    assert not any(name.startswith("true_m_p") for name in parquet.read_schema(files / f"{OTHER}.parquet").names)
    assert dataset.BENCHMARK == ("lever_trim_dither_rough", "step_up")


def test_the_same_seeds_give_files_with_the_same_checksums(files: Path, tmp_path: Path) -> None:
    list(dataset.write(tmp_path / "again", [TRIM], PLAN))
    checksums = [json.loads((folder / dataset.INDEX).read_text())["cases"][TRIM]["sha256"] for folder in
                 (files, tmp_path / "again")]  # fmt: skip
    assert checksums[0] == checksums[1]


def test_a_file_that_was_changed_is_refused(tmp_path: Path) -> None:
    list(dataset.write(tmp_path, [TRIM], PLAN))
    with (tmp_path / f"{TRIM}.parquet").open("ab") as file:
        file.write(b"\0")
    with pytest.raises(LeverError, match="another SHA-256"):
        dataset.read(tmp_path, TRIM)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (None, "lever compare --data"),
        ("{}", "is no index"),
        ("[", "is no index"),
        ('{"format": 1}', "is no index"),
        ('{"format": 9}', "has format 9"),
    ],
)
def test_an_index_that_cannot_be_read_says_what_to_do(text: str | None, says: str, tmp_path: Path) -> None:
    if text is not None:
        (tmp_path / dataset.INDEX).write_text(text, encoding="utf-8")
    with pytest.raises(LeverError, match=says):
        dataset.plan_of(tmp_path)


def test_scores_are_those_of_the_estimates(files: Path) -> None:
    """Of an estimator that stays at the first guess, drawn and from files."""
    rows = []
    for plan in (PLAN, dataset.plan_of(files)[0]):
        entrants.enter("own_estimators:Guess")
        results = run_cases.run(run_cases.tasks([TRIM], ["own_estimators:Guess"], plan), jobs=1)
        rows += evaluation.judge(results)
    batch = cases()[TRIM].batch(PLAN)
    assert batch.truth.p is not None
    at = np.arange(400, 1500, 100)
    relative = np.log(batch.knowledge.guess / batch.truth.p[:, at])
    covered = np.mean(np.abs(relative) <= 2.0 * batch.knowledge.sigma, axis=(0, 1))
    for row in rows:
        assert row.rms[:3] == pytest.approx(np.sqrt(np.mean(relative**2, axis=(0, 1))))
        assert row.covered[:3] == pytest.approx(covered)
        assert (row.runs, row.failures, row.ours) == (2, 0, False)


def test_an_estimator_that_breaks_down_is_counted() -> None:
    entrants.enter("own_estimators:Breaks")
    results = run_cases.run(run_cases.tasks([TRIM], ["own_estimators:Breaks"], PLAN), jobs=1)
    (row,) = evaluation.judge(results)
    assert (row.runs, row.failures, row.ranked) == (2, 2, False)


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("own_estimators", "name an estimator as MODULE:CLASS"),
        ("no_such_module:Guess", "cannot be imported"),
        ("own_estimators:Missing", "cannot be imported"),
        ("own_estimators:Half", "has no method step()"),
    ],
)
def test_what_is_no_estimator_is_said_in_a_line(name: str, says: str) -> None:
    with pytest.raises(LeverError, match=re.escape(says)) as caught:
        candidate(name)
    assert "\n" not in str(caught.value)


def test_a_class_is_found_in_the_folder_where_the_command_is_called(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    methods = "".join(f"    def {name}(self, *given): ...\n" for name in ("start", "step", "estimate"))
    folder = tmp_path / "elsewhere"
    folder.mkdir()
    (folder / "of_this_folder.py").write_text(f"class Here:\n{methods}")
    monkeypatch.setattr(sys, "path", list(sys.path))
    with pytest.raises(LeverError, match="cannot be imported"):
        candidate("of_this_folder:Here")
    monkeypatch.chdir(folder)
    assert callable(candidate("of_this_folder:Here"))


def test_an_estimate_of_another_shape_is_refused() -> None:
    batch = cases()[TRIM].batch(Plan(seeds=1, duration=1.0))
    with pytest.raises(LeverError, match=re.escape("parameters have the shape (2,)")):
        candidate("own_estimators:Short")(batch, np.array([500]))


def test_move_is_the_step_of_the_batch() -> None:
    batch = cases()[TRIM].batch(Plan(seeds=1, duration=1.0))
    config = Config(batch.model, batch.period, batch.knowledge)
    signals = np.concatenate((batch.y[0], batch.u[0], batch.trim[0][:, np.newaxis]), axis=-1)
    before, after = (Sample._make((k * batch.period, *signals[k])) for k in (700, 701))
    w = np.array([[0.1, -0.2, 0.3]])
    moved = config.move(batch.y[0, 700], batch.knowledge.physical(w[0]), before, after)
    np.testing.assert_allclose(moved, batch.move(700, batch.y[:, 700], w)[0], rtol=1e-12)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("--data", "there", "--out", "x"), "--out does not go with --data alone"),
        (("--data", "there", "--score", "own_estimators:Guess", "--seeds", "3"), "--seeds does not go with --data"),
        (("--data", "there", "--score", "own_estimators:Guess"), "`lever compare --data there` writes it"),
        (("--score", "own_estimators:Nobody"), "cannot be imported"),
        (("--data", "there", "--scenarios", "nonsense"), "no scenario 'nonsense'"),
        (("--paper", "--score", "own_estimators:Guess"), "--score does not go with --paper"),
        (("--envelope", "--data", "there"), "--data does not go with --envelope"),
    ],
)
def test_the_command_says_what_does_not_go_together(
    words: tuple[str, ...], says: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["compare", *words]) == 2
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert says in line


def test_the_example_of_the_page_is_the_joint_ukf(root: Path, tmp_path: Path) -> None:
    """In 40 lines at most; FilterPy's filter and ours differ in their sigma points alone."""
    page = (root / "sil/lever_sil/study/PAPER.md").read_text(encoding="utf-8")
    (code,) = re.findall(r"cat > \S+/ukf\.py <<'END'\n(.*?)^END$", page, re.DOTALL | re.MULTILINE)
    assert len(code.splitlines()) <= 40
    (tmp_path / "ukf.py").write_text(code, encoding="utf-8")
    batch = cases()[TRIM].batch(Plan(seeds=1, duration=3.0))
    at = np.array([2999])
    theirs, ours = candidate("ukf:Ukf")(batch, at), BASELINES["joint_ukf"].run(batch, at)
    assert theirs.covariance is not None
    assert ours.covariance is not None
    sigma = np.sqrt(np.diagonal(ours.covariance[0, 0]))
    assert np.abs(theirs.w - ours.w).max() < 0.1 * sigma.min()
    np.testing.assert_allclose(np.sqrt(np.diagonal(theirs.covariance[0, 0])), sigma, rtol=0.05)
