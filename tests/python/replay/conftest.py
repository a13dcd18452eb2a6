"""What the tests of logs and replay share: a short simulated session, as a log."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import pytest
from lever_cdkf.host_tools.bus import LeverBus
from lever_cdkf.host_tools.native import Config
from lever_cdkf.sil import scenario
from lever_cdkf.sil.runner import Result, simulate

SHORT = ["duration=6 s", "converged_after=2 s", "limits={}"]


@dataclass(frozen=True)
class Session:
    """A simulation and the log it left."""

    result: Result
    folder: Path
    config: Config
    """Of its estimator."""

    @property
    def log(self) -> Path:
        return self.folder / "bus.log"

    @property
    def lines(self) -> list[str]:
        return self.log.read_text().splitlines()


def simulated(name: str, folder: Path, *overrides: str) -> Session:
    """A short run of a scenario."""
    made = scenario.load(name, [*SHORT, *overrides])
    with LeverBus("lever", config=made.config) as bus:
        return Session(simulate(made, bus, folder), folder, made.config)


@pytest.fixture(scope="session")
def session(tmp_path_factory: pytest.TempPathFactory) -> Session:
    return simulated("steady", tmp_path_factory.mktemp("session"))
