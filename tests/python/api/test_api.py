"""The public names of lever_cdkf: they are there, they cost nothing until used, and they do what their page says."""

from __future__ import annotations

import subprocess
import sys
from importlib import metadata
from pathlib import Path

import lever_cdkf
import pytest
from lever_cdkf.errors import LeverError

PUBLIC = [
    "Config",
    "Estimator",
    "LeverError",
    "Result",
    "__version__",
    "estimate",
    "load_scenario",
    "run_samples",
    "simulate",
]


def test_the_public_names_are_these() -> None:
    assert lever_cdkf.__all__ == PUBLIC
    assert all(callable(getattr(lever_cdkf, name)) for name in PUBLIC if name != "__version__")
    assert set(PUBLIC) <= set(dir(lever_cdkf))
    with pytest.raises(AttributeError, match="no attribute 'Scenario'"):
        _ = lever_cdkf.Scenario
    assert lever_cdkf.LeverError is LeverError
    assert lever_cdkf.__version__ == metadata.version("lever-cdkf")


def test_importing_loads_nothing_of_it() -> None:
    listed = "import sys, lever_cdkf; print(*(name for name in sys.modules if name.startswith('lever_cdkf.')))"
    done = subprocess.run([sys.executable, "-c", listed], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


def test_what_is_no_scenario(root: Path) -> None:
    for nothing in (5, None):
        with pytest.raises(LeverError, match="is no scenario: give its name"):
            lever_cdkf.load_scenario(nothing)  # type: ignore[arg-type]
    assert lever_cdkf.load_scenario(root / "sil" / "lever_sil" / "scenarios" / "steady.toml").title


def test_a_name_is_no_scenario_yet() -> None:
    with pytest.raises(LeverError, match=r"scenario is a str: give what load_scenario\('steady'\) returns"):
        lever_cdkf.simulate("steady")  # type: ignore[arg-type]


def test_a_scenario_runs_without_a_bus() -> None:
    from lever_cdkf import load_scenario, simulate

    steady = load_scenario("steady", ["duration=0.5 s", "converged_after=0.1 s", "limits={}"])
    result = simulate(steady)
    assert result.summary.samples == len(result.trace["time_s"]) == 500
    assert result.summary.unanswered == 0
