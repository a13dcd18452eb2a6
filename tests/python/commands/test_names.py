"""Names that users type: of faults, conditions, cases, scenarios, specs and figures."""

from __future__ import annotations

import re

import pytest
from python.conftest import Run


@pytest.mark.parametrize("command", ["faults", "envelope", "bounce", "compare", "sim", "campaign", "figures"])
def test_names_are_words_joined_by_underscores_and_each_is_there_once(
    command: str, lever: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They are also names of files, and of places on pages."""
    monkeypatch.setenv("COLUMNS", "300")
    status, printed, _ = lever(command, "--list")
    assert status == 0
    table = printed.partition("─\n")[2].partition("\n\n")[0]
    names = [line.split()[0] for line in table.splitlines()]
    assert len(names) == len(set(names)) > 1
    assert [name for name in names if not re.fullmatch(r"[a-z0-9.]+(_[a-z0-9.]+)*", name)] == []
