"""What every Python test can use: where the build is, and what to do about a tool that is not installed.

A test that needs a tool of the system is marked `@pytest.mark.requires("candump")` (several names: all are needed;
"clang-19|clang": one of them is). Without the tool it is skipped, with the command that installs it, and ctest shows
the folder as skipped. With LEVER_REQUIRE_ALL=1 (CI) every skip, whatever its reason, is an error.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Generator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
REQUIRE_ALL = os.environ.get("LEVER_REQUIRE_ALL") == "1"
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # numpy's: more of them wait for each other, at full load


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line("markers", "requires(*tools): skip unless these programs are installed")
    config.addinivalue_line("markers", "requirement(*numbers): proves these of firmware/REQUIREMENTS.md")


def pytest_runtest_setup(item: pytest.Item) -> None:
    for mark in item.iter_markers("requires"):
        missing = [tool for tool in mark.args if not any(shutil.which(name) for name in tool.split("|"))]
        if missing:
            packages = ROOT / "tests/setup/debian-packages.txt"
            names = [line.split()[0] for line in packages.read_text().splitlines() if line and line[0] != "#"]
            pytest.skip(f"no {', '.join(missing)} here: apt install {' '.join(names)}")


def _skip_is_failure(report: pytest.CollectReport | pytest.TestReport) -> None:
    if REQUIRE_ALL and report.skipped and not hasattr(report, "wasxfail"):
        report.outcome = "failed"
        reason = report.longrepr[2] if isinstance(report.longrepr, tuple) else report.longrepr
        report.longrepr = f"{report.nodeid}: {reason} (LEVER_REQUIRE_ALL=1: nothing may be skipped)"


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport() -> Generator[None, pytest.TestReport, pytest.TestReport]:
    report = yield
    _skip_is_failure(report)
    return report


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report() -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
    report = yield
    _skip_is_failure(report)
    return report


def pytest_sessionfinish(session: pytest.Session, exitstatus: int) -> None:
    """Report a run with skips to ctest as no pass, by the exit status LEVER_SKIPPED_STATUS."""
    terminal = session.config.pluginmanager.get_plugin("terminalreporter")
    if exitstatus == pytest.ExitCode.OK and terminal is not None and terminal.stats.get("skipped"):
        session.exitstatus = int(os.environ.get("LEVER_SKIPPED_STATUS", exitstatus))


@pytest.fixture(scope="session")
def root() -> Path:
    """Return the source tree."""
    return ROOT


@pytest.fixture(scope="session")
def build_dir() -> Path:
    """Return the CMake build tree: lever_can, firmware/liblever_cdkf.so, venv/ … are in it."""
    return Path(os.environ.get("LEVER_BUILD_DIR", ROOT / "build"))


Built = Callable[[str, str], Path]


@pytest.fixture(scope="session")
def built(build_dir: Path) -> Built:
    """built(path, name): what the entry `name` of ctest builds there in the build tree, before the tests."""

    def file(path: str, name: str) -> Path:
        if not (build_dir / path).exists():
            pytest.skip(f"no {build_dir / path}: ctest --test-dir {build_dir} -R {name}")
        return build_dir / path

    return file


@pytest.fixture(scope="session")
def can_image(built: Built) -> Path:
    """Return the image for the STM32F405 whose frames travel over bxCAN; .bin, .hex and .map are beside it."""
    return built("stm32f4/lever_stm32f4_can.elf", "build.stm32f4")


@pytest.fixture(scope="session")
def slcan_image(built: Built) -> Path:
    """Return the image whose frames travel as SLCAN over USART1; .bin, .hex and .map are beside it."""
    return built("stm32f4/lever_stm32f4_slcan.elf", "build.stm32f4")
