"""Ctrl-C: always exit status 130 and one line, also where Python loses its KeyboardInterrupt or has hardly begun."""

from __future__ import annotations

import argparse
import importlib
import importlib.metadata
import signal
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from lever_cdkf.cli import entry_point
from lever_cdkf.cli.main import main
from lever_cdkf.cli.progress import Progress
from lever_cdkf.errors import LeverError
from lever_cdkf.runtime import interrupts
from lever_cdkf.runtime.files import Outputs
from python.conftest import Session

Act = Callable[[Callable[[], None]], int]
LINE = "lever: interrupted\n"


def lost_in_a_deletion() -> None:
    class Deleted:
        def __del__(self) -> None:
            signal.raise_signal(signal.SIGINT)

    Deleted()


def lost_in_a_library() -> None:
    with suppress(BaseException):  # as asammdf does
        signal.raise_signal(signal.SIGINT)


lost = pytest.mark.parametrize("lose", [lost_in_a_deletion, lost_in_a_library])


@pytest.fixture
def act(monkeypatch: pytest.MonkeyPatch) -> Act:
    """act(run): the exit status of a command that is `run`."""

    def command(run: Callable[[], None]) -> int:
        def status(_: argparse.Namespace) -> int:
            run()
            return 0

        module = SimpleNamespace(add_parser=lambda parsers: parsers.add_parser("act"), run=status)
        entry: Any = SimpleNamespace(value="here", load=lambda: module)
        monkeypatch.setattr(importlib.metadata, "entry_points", lambda group: [entry])
        return main(["act"])

    return command


@lost
def test_a_lost_one_is_found_at_the_end(lose: Callable[[], None], act: Act, capfd: pytest.CaptureFixture[str]) -> None:
    before = signal.getsignal(signal.SIGINT), sys.unraisablehook
    assert act(lose) == 130
    assert capfd.readouterr() == ("", LINE)
    assert (signal.getsignal(signal.SIGINT), sys.unraisablehook) == before
    assert act(lambda: None) == 0


@lost
def test_a_lost_one_is_found_where_progress_is_shown(lose: Callable[[], None], act: Act) -> None:
    reached = []

    def run() -> None:
        with Progress("act") as progress:
            lose()
            progress.show(0, 1)
            reached.append(True)

    assert act(run) == 130
    assert not reached


@lost
def test_a_lost_one_is_found_before_files_are_put_into_place(
    lose: Callable[[], None], act: Act, tmp_path: Path
) -> None:
    def run() -> None:
        with Outputs(tmp_path) as outputs:
            outputs.path("a").write_text("text")
            lose()
            outputs.finish()

    assert act(run) == 130
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize(
    "command",
    [
        "sim steady",
        "replay LOG",
        "replay LOG --each",
        "compare --quick",
        "figures --only bode",
        "envelope --only steady --seeds 1",
        "bounce --only alarm --seeds 1",
        "faults --quick",
    ],
)
def test_an_interrupted_command_leaves_no_folder(
    command: str, number: int, session: Session, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """While its first progress is shown; made folders have one above them that is made, too."""

    def come(*_: object) -> None:
        (come_to,) = tmp_path.rglob("out")  # a place for what comes of it, before the work
        assert come_to.is_dir()
        signal.raise_signal(number)

    monkeypatch.setattr(Progress, "show", come)
    before = signal.getsignal(number)
    words = command.replace("LOG", str(session.log)).split()
    assert main([*words, "--out", str(tmp_path / "new" / "out")]) == 130
    assert list(tmp_path.iterdir()) == []
    assert signal.getsignal(number) is before


@lost
def test_what_fails_after_a_lost_one_is_not_told(
    lose: Callable[[], None], act: Act, capfd: pytest.CaptureFixture[str]
) -> None:
    def run() -> None:
        lose()
        raise LeverError("half of it is not there")

    assert act(run) == 130
    assert capfd.readouterr() == ("", LINE)
    interrupts.check()


@pytest.mark.parametrize("name", ["lever_cdkf.runtime.exit_status", "argparse"])
def test_it_is_heard_while_the_command_is_still_being_read(name: str) -> None:
    """Ctrl-C while `lever` imports what it needs, the first module and others."""
    program = (
        "import signal, sys\n"
        "class Finder:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        f"        if name == {name!r}: signal.raise_signal(signal.SIGINT)\n"
        "sys.meta_path.insert(0, Finder())\n"
        "from lever_cdkf.cli.entry_point import main\n"
        "sys.exit(main())\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", LINE)


def test_it_changes_nothing_once_all_is_done() -> None:
    """Ctrl-C while Python ends: not a death by the signal (-2)."""
    program = (
        "import signal, sys\n"
        "from lever_cdkf.cli.entry_point import main\n"
        "class Last:\n"
        "    def __del__(self): signal.raise_signal(signal.SIGINT)\n"
        "sys.last = Last()\n"
        "sys.argv = ['lever', 'dbc', '--path']\n"
        "sys.exit(main())\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.endswith("lever.dbc\n")


def test_it_stays_ignored_where_it_is() -> None:
    """As by nohup, and in the background of a shell."""
    program = (
        "import signal\n"
        "signal.signal(signal.SIGINT, signal.SIG_IGN)\n"
        "from lever_cdkf.cli import entry_point\n"
        "from lever_cdkf.commands import dbc\n"
        "run = dbc.run\n"
        "dbc.run = lambda args: (signal.raise_signal(signal.SIGINT), run(args))[1]\n"
        "import sys; sys.argv = ['lever', 'dbc', '--path']\n"
        "sys.exit(entry_point.main())\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


def test_the_script_starts_where_it_is_caught() -> None:
    (script,) = importlib.metadata.entry_points(group="console_scripts", name="lever")
    assert script.value == "lever_cdkf.cli.entry_point:main"


def test_worker_processes_leave_it_to_their_parent_from_the_start() -> None:
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, ())
    with interrupts.worker_pool(2) as pool:
        assert signal.pthread_sigmask(signal.SIG_BLOCK, ()) == mask
        assert signal.SIGINT in pool.apply(signal.pthread_sigmask, (signal.SIG_BLOCK, ()))


def test_ctrl_c_while_the_command_itself_is_imported(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    class Interrupted:
        """A finder at whose import Ctrl-C comes."""

        def find_spec(self, name: str, *_: object) -> None:
            if name == "lever_cdkf.runtime.exit_status":
                raise KeyboardInterrupt

    monkeypatch.delitem(sys.modules, "lever_cdkf.runtime.exit_status")
    monkeypatch.setattr(sys, "meta_path", [Interrupted(), *sys.meta_path])
    with pytest.raises(SystemExit) as ended:
        importlib.reload(entry_point)
    assert ended.value.code == 130
    assert capsys.readouterr().err == "lever: interrupted\n"
