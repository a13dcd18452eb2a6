"""The command `lever`. Each sub-command is a small module of its own, found through the entry points below."""

from __future__ import annotations

import argparse
import codecs
import errno
import importlib.metadata
import io
import os
import re
import sys
from collections.abc import Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import Any, NoReturn

from ..errors import LeverError
from ..runtime import interrupts
from ..runtime.exit_status import INTERRUPTED, MESSAGE
from ..runtime.extras import hide_mf4, reveal_mf4
from ..runtime.files import STANDARD_OUTPUT, check_writable, prints_aside
from ..runtime.provenance import version
from ..text.suggestions import did_you_mean
from .help_text import HelpFormatter
from .layout import warn

COMMANDS = "lever_cdkf.commands"
"""Entry point group of modules that hold sub-commands. Such a module has

    def add_parser(subparsers) -> None     registers one or more with subparsers.add_parser(name, help=…)
    def run(args) -> int                   runs them and returns the exit status

and imports what is heavy inside run(), because all are imported for every call of `lever`. A parser may have a run of
its own, by set_defaults(run=…).
"""

GROUPS = {
    "simulate": ("demo", "sim", "fmu", "aircraft"),
    "logs": ("replay", "map", "tune"),
    "a bus": ("monitor", "live", "record", "dbc", "settings"),
    "a board": ("flash", "qemu"),
    "test the firmware": ("envelope", "faults", "bounce", "soak"),
    "study": ("compare", "campaign", "figures"),
}
"""Commands by purpose, in the order of --help; those of other packages come last."""

_DESCRIPTION = """\
Lever CDKF: estimates the equivalent mass, damping and stiffness of a helicopter pilot's arm on the collective lever,
on line, from samples on a CAN bus. The estimator is C firmware; this command runs, feeds and inspects it.
"""
_EPILOG = """\
a first session:
  lever demo                          simulate a pilot; write a report
  lever sim --list                    the scenarios; lever sim NAME runs one
  lever live --scenario demo          watch it in a browser
  lever monitor --scenario demo       watch it in the terminal
  lever replay session.log            estimate from a recorded log
  lever map flight.blf --dbc it.dbc   inputs in a log with other messages
  lever settings                      settings with units and ranges
  lever dbc                           the CAN messages

`lever` alone prints this; `lever COMMAND --help` explains a command. Exit status: 0 when all went well; 1 when the
command ran, but what it checks does not hold (limits of a scenario, no estimate from a log, …); 2 with one line on
standard error when the command line or an input is wrong; 130, with one line too, after Ctrl-C or SIGTERM.
A log that is cut off is used as far as it goes, with a warning on standard error.

Tables wrap at the width of the terminal. In a pipe or file each row is one line, unless COLUMNS says how wide.
"""


class Parser(argparse.ArgumentParser):
    """argparse, but an error is one line that says where to read on."""

    def __init__(self, **kwargs: Any) -> None:
        kwargs.setdefault("formatter_class", HelpFormatter)
        super().__init__(allow_abbrev=False, **kwargs)

    def error(self, message: str) -> NoReturn:
        """Raise LeverError with one line, instead of printing the usage."""
        if choice := re.fullmatch(r"(.*invalid choice: )('.*') \(choose from (.*)\)", message):
            names = [name.strip("' ") for name in choice[3].split(",")]
            message = did_you_mean(choice[2].strip("'"), names, "")
            message = f"{choice[1]}{choice[2]}: {message}" if message else choice[0]
        raise LeverError(f"{message} (see `{self.prog} --help`)")

    def _get_value(self, action: argparse.Action, arg_string: str) -> Any:
        """As argparse does, but a file or folder without a name is an error: Path("") is the current folder."""
        if not arg_string and (action.type is Path or action.dest in ("out", "output")):
            raise argparse.ArgumentError(action, "it is empty: give a name")
        return super()._get_value(action, arg_string)


class _Group(argparse.Action):
    """A heading with some commands, as the formatter of help wants it."""

    def __init__(self, title: str, commands: list[argparse.Action]) -> None:
        super().__init__([], title, help="", metavar=title)
        self._commands = commands

    def _get_subactions(self) -> list[argparse.Action]:
        return self._commands

    def __call__(self, *_: Any, **__: Any) -> None:
        """Do nothing: a heading is never parsed."""


class _Commands(argparse._SubParsersAction):  # type: ignore[type-arg]  # generic for type checkers only
    """The sub-commands; help shows them by purpose."""

    def _get_subactions(self) -> list[argparse.Action]:
        left = {command.dest: command for command in super()._get_subactions()}
        groups = {title: [left.pop(name) for name in names if name in left] for title, names in GROUPS.items()}
        groups["other packages"] = list(left.values())
        return [_Group(title, commands) for title, commands in groups.items() if commands]


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command line and return its exit status: 0 only when all went well."""
    if not _has_streams():
        return 2
    hide_mf4(sys.argv[1:] if argv is None else argv)
    try:
        try:
            args = _parser().parse_args(argv)
            _check_json(args)
            if (prepare := getattr(args, "prepare", None)) is not None:
                prepare(args)
            with (
                interrupts.heard(),
                prints_aside() if getattr(args, "json", None) == STANDARD_OUTPUT else nullcontext(),
            ):
                status: int = args.run(args) or 0
        except SystemExit as stop:  # --help and --version
            status = int(stop.code or 0)
        sys.stdout.flush()
        return status
    except KeyboardInterrupt as stop:
        print(": ".join((MESSAGE, *map(str, stop.args))), file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:  # the reader, such as `head`, has what it wants; nothing is left to say at exit either
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except Exception as error:
        if not isinstance(error, _expected()):
            raise
        print(f"lever: error: {' '.join(_said(error).split())}", file=sys.stderr)
        return 2
    finally:
        reveal_mf4()


def _has_streams() -> bool:
    """Return whether there is a standard output, without which nothing is worth running.

    Standard error and input that are closed become as /dev/null.
    """
    for name, mode in (("stdin", "r"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: SIM115  for the life of the process
    if sys.stdout is None:
        print("lever: error: standard output is closed: send it to a file or to /dev/null", file=sys.stderr)
        return False
    if isinstance(sys.stdout, io.TextIOWrapper):  # a letter that it has not is no reason to end
        is_utf8 = codecs.lookup(sys.stdout.encoding).name == "utf-8"
        sys.stdout.reconfigure(errors="surrogateescape" if is_utf8 else "replace")
    return True


def _check_json(args: argparse.Namespace) -> None:
    """Before a command has worked for --json FILE; a folder that it makes itself, by --out, need not be there yet."""
    path, out = getattr(args, "json", None), getattr(args, "out", None)
    if path is not None and path != STANDARD_OUTPUT:
        folders = () if out is None else (Path(out).absolute(), *Path(out).absolute().parents)
        if Path(path).absolute().parent not in folders or Path(path).parent.exists():
            check_writable(path)


def _said(error: Exception) -> str:
    """Return what is said of an error; a full disk without the name of a file is that of standard output."""
    if isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EFBIG) and error.filename is None:
        return f"cannot write standard output: {error.strerror}"
    return str(error)


def _expected() -> tuple[type[Exception], ...]:
    """Return errors that are printed without a traceback."""
    can = sys.modules.get("can")
    return (LeverError, OSError) if can is None else (LeverError, OSError, can.CanError)


def _parser() -> Parser:
    parser = Parser(prog="lever", description=_DESCRIPTION, epilog=_EPILOG)
    parser.add_argument("--version", action="version", version=f"lever {version()}")
    parser.set_defaults(run=lambda _: parser.print_help())
    subparsers = parser.add_subparsers(title="commands", metavar="COMMAND", action=_Commands)
    for entry in sorted(importlib.metadata.entry_points(group=COMMANDS)):
        try:
            module = entry.load()
        except Exception as error:
            warn(f"no commands from {entry.value}: {error}")
            continue
        before = set(subparsers.choices)
        module.add_parser(subparsers)
        for name in subparsers.choices.keys() - before:
            if subparsers.choices[name].get_default("run") is None:
                subparsers.choices[name].set_defaults(run=module.run)
    return parser


if __name__ == "__main__":
    sys.exit(main())
