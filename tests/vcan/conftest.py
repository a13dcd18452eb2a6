"""Runs all tests of this folder in one place that has a vcan0 (place.py), and reports each here as if it had run here.

Inside that place (environment variable LEVER_VCAN) they are ordinary tests. Outside, the first of them starts a second
pytest inside, with all of them that are selected; that writes its reports to a file, from which each test is reported.
Tests marked `outside` are about the place itself and stay out.
"""

from __future__ import annotations

import functools
import json
import os
import sys
import tempfile
from collections import defaultdict
from collections.abc import Generator, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from lever_cdkf.runtime.extras import hide_mf4
from vcan import place, uml

INSIDE = os.environ.get(place.INSIDE) == "1"
if INSIDE:
    hide_mf4(())  # which would take seconds there

from vcan import rig  # noqa: E402

FOLDER = Path(__file__).parent
TIME_LIMIT_S = 3000.0
"""For what hangs; nothing is expected to be fast."""
REPORTS = "LEVER_VCAN_REPORTS"
"""Environment variable: the file into which the inner pytest writes its reports, one JSON object a line."""

Reports = dict[str, list[pytest.TestReport]]
_reports = pytest.StashKey[Reports]()


@functools.cache
def _obstacle() -> str | None:
    """Return why there is no place with a vcan0, in words; None if there is one."""
    try:
        if not place.kernel_has_vcan():
            uml.find_machine()
    except uml.UmlError as error:
        return str(error)
    return None


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line("markers", "outside: of the place itself, so not to be run inside")


def _belongs_inside(item: pytest.Item) -> bool:
    return item.path.is_relative_to(FOLDER) and item.get_closest_marker("outside") is None


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Outside, where there is no place: skips the test."""
    if not INSIDE and _belongs_inside(item):
        pytest.skip(str(_obstacle()))


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_protocol(item: pytest.Item) -> bool | None:
    """Outside: reports what happened to the test inside."""
    if INSIDE or _obstacle() or not _belongs_inside(item):
        return None
    session = item.session
    if _reports not in session.stash:
        session.stash[_reports] = _run_inside(session)
    item.ihook.pytest_runtest_logstart(nodeid=item.nodeid, location=item.location)
    for report in session.stash[_reports][item.nodeid]:
        item.ihook.pytest_runtest_logreport(report=report)
    item.ihook.pytest_runtest_logfinish(nodeid=item.nodeid, location=item.location)
    return True


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Inside: also writes the report down."""
    report = yield
    if INSIDE and REPORTS in os.environ:
        data = item.config.hook.pytest_report_to_serializable(config=item.config, report=report)
        with open(os.environ[REPORTS], "a", encoding="utf-8") as file:
            file.write(json.dumps(data) + "\n")
    return report


def _run_inside(session: pytest.Session) -> Reports:
    """Return the reports by test; one without a report has died, and has a failure that shows what was last printed."""
    config = session.config
    items = [item for item in session.items if _belongs_inside(item)]
    tests = [str(config.rootpath / item.nodeid) for item in items]
    options = ("-p", "no:cacheprovider", "-p", "no:hypothesispytest", f"--rootdir={config.rootpath}")
    pytest_here = [sys.executable, "-m", "pytest", "--quiet", *options]
    found: Reports = defaultdict(list)
    with tempfile.TemporaryDirectory(prefix="lever-vcan-") as folder, open(f"{folder}/output", "w+b") as output:
        reports = Path(folder, "reports")
        reports.touch()
        environment = {**os.environ, REPORTS: str(reports)}
        command = [*pytest_here, f"--basetemp={folder}/tests", *tests]
        try:
            place.run(command, environment=environment, time_limit_s=TIME_LIMIT_S, stdout=output, stderr=output)
            problem = "the test did not run to its end"
        except (TimeoutError, uml.UmlError) as error:
            problem = str(error)
        for line in reports.read_text(encoding="utf-8").splitlines():
            report = config.hook.pytest_report_from_serializable(config=config, data=json.loads(line))
            found[report.nodeid].append(report)
        output.seek(0)
        said = "\n".join(output.read().decode(errors="replace").splitlines()[-40:])
    for item in items:
        if [report.when for report in found[item.nodeid]][-1:] != ["teardown"]:
            text = f"{problem}; the output inside ends with:\n{said}"
            found[item.nodeid] = [pytest.TestReport(item.nodeid, item.location, {}, "failed", text, "call")]
    return found


@pytest.fixture
def interface() -> Iterator[str]:
    """Yield a virtual CAN interface, up, new for this test."""
    with rig.new_interface() as name:
        yield name


@pytest.fixture
def host(interface: str) -> Iterator[rig.Host]:
    """Somebody on that interface."""
    there = rig.Host.on(interface)
    yield there
    there.bus.shutdown()


@pytest.fixture
def start(build_dir: Path, tmp_path: Path, interface: str) -> Iterator[rig.Starter]:
    """Yield a function that starts lever_can on the interface with further options; end what is left of it after the
    test."""
    with ExitStack() as stack:
        yield lambda *options, supervised=False: stack.enter_context(
            rig.LeverCan(build_dir / "lever_can", interface, options, tmp_path, supervised=supervised)
        )
