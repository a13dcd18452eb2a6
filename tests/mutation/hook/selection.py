"""Pytest's part of tests/mutation/host.py, as a plug-in.

REACHED: notes what each test calls in a folder of its own in that one, and lists the tests that pass, with folder and
seconds, in `passed.json` there. What a fixture of more than one test calls, or a test beside functions that keep their
results, stays with the file.
SELECTED: a file with the tests to run, in their order, and the seconds that each may take; null: not to run. A test
that it does not have runs first.
"""

from __future__ import annotations

import faulthandler
import json
import os
import signal
import time
from collections.abc import Generator
from pathlib import Path

import pytest
from sitecustomize import note_in  # type: ignore[import-not-found]

IMPORTING = 300.0
"""[s] An interpreter that has not begun with its tests by then hangs."""


class Reach:
    def __init__(self, whole: str) -> None:
        self._whole = whole
        self._begun = 0
        self._passed: dict[str, tuple[str, float]] = {}

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Function) -> Generator[None, object, object]:
        keeps = any(hasattr(each, "cache_clear") for each in vars(item.module).values())
        self._begun += 1
        self._folder = self._whole if keeps else f"{self._whole}/{self._begun}"
        self._start = time.monotonic()
        note_in(self._folder)
        try:
            return (yield)
        finally:
            note_in(self._whole)

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(self, fixturedef: pytest.FixtureDef[object]) -> Generator[None, object, object]:
        if fixturedef.scope == "function":
            return (yield)
        test = note_in(self._whole)
        try:
            return (yield)
        finally:
            note_in(test)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.when == "call" and report.passed:
            self._passed[report.nodeid] = self._folder, time.monotonic() - self._start

    def pytest_sessionfinish(self) -> None:
        Path(self._whole, "passed.json").write_text(json.dumps(self._passed))


class Selection:
    def __init__(self, limits: dict[str, float | None]) -> None:
        self._limits = limits

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        new = [item for item in items if item.nodeid not in self._limits]
        known = {item.nodeid: item for item in items}
        items[:] = new + [known[name] for name, limit in self._limits.items() if limit and name in known]

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> None:
        faulthandler.dump_traceback_later(self._limits.get(item.nodeid) or IMPORTING, exit=True)


def pytest_configure(config: pytest.Config) -> None:
    signal.signal(signal.SIGHUP, signal.SIG_IGN)  # pytest leads its session: a test's pseudo-terminal would end it
    if "REACHED" in os.environ:
        config.pluginmanager.register(Reach(os.environ["REACHED"]))
    if "SELECTED" in os.environ:
        faulthandler.dump_traceback_later(IMPORTING, exit=True)
        config.pluginmanager.register(Selection(json.loads(Path(os.environ["SELECTED"]).read_text())))
