"""FMUs that several tests look at, made once by the command `lever`."""

from __future__ import annotations

from pathlib import Path

import pytest
from lever_cdkf.cli.main import main
from python.fmu.importer import unpacked


@pytest.fixture(scope="session")
def fmus(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with lever.fmu and pilot.fmu, with two seeds of the scenario demo."""
    folder = tmp_path_factory.mktemp("fmus")
    assert main(["fmu", "controller", "-o", str(folder / "lever.fmu")]) == 0
    assert main(["fmu", "pilot", "-o", str(folder / "pilot.fmu"), "--seeds", "2"]) == 0
    return folder


@pytest.fixture(scope="session")
def controller(fmus: Path) -> Path:
    """lever.fmu, unpacked."""
    return unpacked(fmus / "lever.fmu", fmus / "lever")


@pytest.fixture(scope="session")
def pilot(fmus: Path) -> Path:
    """pilot.fmu, unpacked."""
    return unpacked(fmus / "pilot.fmu", fmus / "pilot")


@pytest.fixture(scope="session")
def bus_fmu(fmus: Path) -> Path:
    """lever.fmu --bus."""
    assert main(["fmu", "controller", "--bus", "-o", str(fmus / "bus.fmu")]) == 0
    return fmus / "bus.fmu"


@pytest.fixture(scope="session")
def bus(bus_fmu: Path) -> Path:
    """Unpacked."""
    return unpacked(bus_fmu, bus_fmu.parent / "bus")
