"""The examples of `lever COMMAND --help`: all can be typed, and what needs neither hardware nor minutes is run, here or
by a page."""

from __future__ import annotations

import os
import re
from argparse import ArgumentParser

import pytest
import readmes
from lever_cdkf.cli.main import _parser
from processes import lever
from quality import tools
from quality.conftest import SourceTree

NOT_RUN = {
    r"--interface|can0": "needs a CAN interface or a serial device",
    r"lever campaign (?!--list)": "takes minutes",
    r"wireshark -C": "needs a display",
    r"lever (live|monitor)(?!.*--once)": "runs until it is ended",
    r"lever (flash|qemu)": "needs the image, with which pages of firmware/port run it",
    r"lever (compare --(out|quick|envelope)|(envelope|bounce|faults) -o|figures (-o|--campaign))": "takes minutes",
    r"lever soak --json": "takes minutes",
    r"model\.mat": "needs a user's own; sil/lever_sil/aircraft/README.md makes and flies one",
    r"lever (bounce|envelope|faults) --quick": "is what tests/python/{bounce,envelope,faults} do",
    r"lever (bounce|envelope|figures) --only|lever soak --hours": "README.md has the same",
    r"lever compare --(score|data)|lever (compare|figures) --paper": "sil/lever_sil/study/PAPER.md has the same",
    r"lever compare --scenarios|lever sim steady --(seed|out)": "sil/README.md has the same",
    r"lever aircraft uh60_like gearing=0.5 -o|(sim|compare|figures) --list": "sil/README.md has the same",
    r"lever campaign --list": "sil/lever_sil/campaign/README.md has the same",
    r"lever settings($| .*preload)|lever dbc($| --path$)": "host_tools/README.md has the same",
    r"lever monitor session.log --once": "host_tools/README.md has the same",
    r"lever fmu": "host_tools/lever_cdkf/fmu/README.md has the same",
    r"lever tune out/steady|lever sim (my_own.toml|steady --settings)": "sil/SIL.md has the same",
    r"lever replay (session.log($| -o)|monday/|flight.blf)": "host_tools/lever_cdkf/replay/README.md has the same",
    r"lever replay .* --aircraft|lever (tune|map) flight.blf": "host_tools/lever_cdkf/replay/README.md has the same",
}
SHORTER = {
    r"--seeds \d+": "--seeds 1",
    r"lever compare (--models .*) --out \S+": r"lever compare --duration 2 --scenarios step_up \1",
    r"--start 60 --length 120": "--length 20.5",
    **readmes.SHORTER,
}
"""The same command, with less to calculate; what `lever compare` writes into a folder, it does for sil/README.md."""
USERS_FILES = """
cp out/session.log session.log
head -n 900 session.log | sed s/vcan0/can1/ | gzip > monday_1.log.gz
tail -n +901 session.log | sed s/vcan0/can1/ | gzip > monday_2.log.gz
echo theta_noise = 1 mrad | tee my.settings > old.settings
"""
"""Besides those that conftest.py makes."""


def parsers() -> dict[str, ArgumentParser]:
    parser = _parser()
    assert parser._subparsers is not None
    return {"": parser, **parser._subparsers._group_actions[0].choices}  # type: ignore[dict-item]


def examples(command: str) -> list[str]:
    """Return the lines to type, without what is said beside them."""
    _, _, text = (parsers()[command].epilog or "").partition(":\n")
    typed = re.findall(r"^  ((?:lever|lever_can|candump)\b[^\\\n]*(?:\\\n[^\\\n]*)*)", text, re.MULTILINE)
    return [re.sub(r" {3,}(?=\S).*$", "", line) if "\\" not in line else line for line in typed]


def reason(line: str) -> str | None:
    return next((reason for pattern, reason in NOT_RUN.items() if re.search(pattern, line)), None)


def test_every_command_has_examples_and_every_reason_is_needed() -> None:
    lines = [line for command in parsers() for line in examples(command)]
    assert [name for name in parsers() if not examples(name)] == ["demo"]
    assert not [pattern for pattern in NOT_RUN if not any(re.search(pattern, line) for line in lines)]
    assert not [pattern for pattern in SHORTER if not any(re.search(pattern, line) for line in lines)]


@pytest.mark.parametrize("command", parsers())
def test_examples_can_be_typed(command: str) -> None:
    for line in examples(command):
        for arguments in readmes.lever_commands(line):
            assert _parser().parse_args(arguments)


@pytest.mark.parametrize("command", [name for name in parsers() if any(not reason(line) for line in examples(name))])
def test_examples_work(command: str, source_tree: SourceTree, monkeypatch: pytest.MonkeyPatch) -> None:
    """In this process: that `lever` starts as one of its own, the pages show. A shell only reads the lines."""
    scratch = source_tree(f"help of {command}")
    monkeypatch.setenv("HOME", str(scratch))
    monkeypatch.chdir(scratch)
    script = "\n".join(line for line in examples(command) if not reason(line))
    for pattern, instead in SHORTER.items():
        script = re.sub(pattern, instead, script)
    tools.assert_silent(["bash", "-euo", "pipefail", "-c", USERS_FILES], cwd=scratch)
    tools.assert_silent(["bash", "-n", "-c", script], cwd=scratch)
    for arguments in readmes.lever_commands(script):
        lever(*map(os.path.expanduser, arguments))
