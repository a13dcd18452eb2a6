"""The command `lever`: help, tables and JSON, one-line errors, exit statuses, and how commands are found."""

from __future__ import annotations

import argparse
import importlib.metadata
import json
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import can
import pytest
from lever_cdkf.can import codec
from lever_cdkf.cli.main import COMMANDS, GROUPS, _parser, main
from lever_cdkf.commands import dbc, settings
from lever_cdkf.errors import LeverError
from lever_cdkf.firmware.config import CHOICES
from lever_cdkf.firmware.native import settings_table
from lever_cdkf.runtime.files import native_file
from processes import LEVER as LEVER_SCRIPT
from python.conftest import Refused

LEVER = [sys.executable, "-m", "lever_cdkf.cli.main"]


def entry(name: str, load: Any) -> Any:
    """Return an entry point as importlib.metadata finds it."""

    class Entry(SimpleNamespace):
        def __lt__(self, other: Any) -> bool:
            return bool(self.name < other.name)

    return Entry(name=name, value=f"somewhere.{name}", load=load)


@pytest.fixture
def commands(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """Return the commands that `lever` finds: those of host_tools, and what a test adds."""
    found = [entry("settings", lambda: settings), entry("dbc", lambda: dbc)]
    monkeypatch.setattr(importlib.metadata, "entry_points", lambda group: found if group == COMMANDS else [])
    return found


def command_that(raises: BaseException) -> Any:
    """Return a module with the command `act`."""

    def run(_args: argparse.Namespace) -> int:
        raise raises

    return SimpleNamespace(add_parser=lambda subparsers: subparsers.add_parser("act"), run=run)


# --- help ------------------------------------------------------------------------------------------------------------


def test_help_of_every_installed_command(installed: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert installed
    with pytest.raises(LeverError, match="invalid choice"):
        _parser().parse_args(["none"])
    names = _parser()._subparsers._group_actions[0].choices  # type: ignore[union-attr]
    assert {"settings", "dbc"} <= set(names or ())
    for arguments in ([], *([name] for name in names or ())):
        assert main([*arguments, "--help"]) == 0
        out, err = capsys.readouterr()
        assert out.startswith(f"usage: {' '.join(['lever', *arguments])} ")
        assert any(words in out for words in ("example", "a first session", "The same as"))
        assert max(map(len, out.splitlines())) <= 120
        assert err == ""


def test_help_lists_commands_by_purpose(installed: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Each command of this project has one; those of other packages come last."""
    assert installed
    names = _parser()._subparsers._group_actions[0].choices  # type: ignore[union-attr]
    assert sorted(names or ()) == sorted(name for group in GROUPS.values() for name in group)
    assert main(["--help"]) == 0
    lines = capsys.readouterr().out.splitlines()
    at = [lines.index(f"    {title}") for title in GROUPS]
    assert at == sorted(at)
    assert "    other packages" not in lines


@pytest.mark.usefixtures("commands")
def test_commands_of_other_packages_come_last(commands: list[Any], capsys: pytest.CaptureFixture[str]) -> None:
    act = SimpleNamespace(add_parser=lambda subparsers: subparsers.add_parser("act", help="do it"), run=None)
    commands.append(entry("act", lambda: act))
    main(["--help"])
    lines = [line.split()[0] for line in capsys.readouterr().out.splitlines() if line.startswith("    ")]
    assert lines.index("other") == lines.index("act") - 1 > lines.index("settings")


@pytest.mark.usefixtures("commands")
def test_version(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.metadata, "version", {"lever-cdkf": "1.2.3"}.__getitem__)
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == "lever 1.2.3\n"


# --- tables ----------------------------------------------------------------------------------------------------------


@pytest.mark.usefixtures("commands")
def test_settings_table(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "a.json"
    assert main(["settings", "--json", str(path)]) == 0
    lines = [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]
    rows = {row["name"]: row for row in json.loads(path.read_text())["settings"]}
    for setting in settings_table():
        row = rows.pop(setting.name)
        assert row == {
            "name": setting.name,
            "unit": setting.unit,
            "default": setting.default,
            "least": setting.least,
            "greatest": setting.greatest,
            "meaning": setting.meaning,
        }
        numbers = f"{setting.default:.6g} {setting.least:.6g} {setting.greatest:.6g}"
        assert f"{setting.name} {setting.unit} {numbers} {setting.meaning}" in lines
    assert list(rows) == [*CHOICES]
    assert "preload trim one of fixed, trim" in lines


@pytest.mark.usefixtures("commands")
def test_settings_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, rows = tmp_path / "my.settings", tmp_path / "a.json"
    assert main(["settings", "--set", "m_p=3", "--set", "preload=fixed", "--set", "m_p = 3.5"]) == 0
    path.write_text(capsys.readouterr().out)
    assert main(["settings", "--settings", str(path), "--set", "c_p=50", "--json", str(rows)]) == 0
    lines = [line.split("  #")[0].rstrip() for line in capsys.readouterr().out.splitlines()]
    assert {"m_p = 3.5", "preload = fixed", "c_p = 50.0", "model = lever"} <= set(lines)
    assert len(lines) == len(CHOICES) + len(settings_table())
    values = {row["name"]: row["value"] for row in json.loads(rows.read_text())["settings"]}
    assert lines == [f"{name} = {value}" for name, value in values.items()]


def test_one_syntax_of_settings_in_all_commands(
    installed: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Numbers in the unit of the table or with a unit, by hand: 2 mrad, 20 degrees, 6 per cent."""
    assert installed
    texts = ["theta_noise=2 mrad", "arm_preload_angle = -20deg", "k_p_walk=6 %/sqrt(s)", "m_p=3", "preload=fixed"]
    expected = {"theta_noise = 0.002", "arm_preload_angle = -0.34906584", "k_p_walk = 0.06", "m_p = 3.0"}
    path = tmp_path / "my.settings"
    path.write_text("\n".join(texts), encoding="utf-8")
    options = [part for text in texts for part in ("--set", text)]
    for arguments in (
        ["settings", *options],
        ["settings", "--settings", str(path)],
        ["sim", "steady", *options, "--settings"],
        ["sim", "steady", "--set", "settings.theta_noise=2 mrad", *options[2:], "--settings"],
    ):
        assert main(arguments) == 0
        lines = {line.split("  #")[0].rstrip() for line in capsys.readouterr().out.splitlines()}
        assert expected | {"preload = fixed"} <= lines, arguments
    for arguments in (["replay", "none.log"], ["tune", "none.log"], ["sim", "steady"], ["settings"]):
        assert main([*arguments, "--set", "theta_noise=2 mm"]) == 2
        assert "'2 mm' has unit 'mm'; allowed: rad, mrad, urad, deg" in capsys.readouterr().err


@pytest.mark.usefixtures("commands")
def test_dbc_table(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "a.json"
    assert main(["dbc", "--json", str(path)]) == 0
    lines = [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]
    assert (
        "LEVER_SAMPLE theta 16 16 True 0.0001 rad -3.2767 3.2767 Lever angle from the floor. -32768 not_available"
        in lines
    )
    assert any(line.startswith("COMMAND 0x120 8 INCEPTOR 33 Requests and choices; ") for line in lines)
    tables = json.loads(path.read_text())
    assert [row["message"] for row in tables["messages"]] == [message.name for message in codec.database().messages]
    described = [(row["message"], row["signal"], row["step"], row["unit"]) for row in tables["signals"]]
    assert described == [
        (message.name, signal.name, signal.scale, signal.unit)
        for message in codec.database().messages
        for signal in message.signals
    ]


@pytest.mark.usefixtures("commands")
def test_dbc_path(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["dbc", "--path"]) == 0
    assert capsys.readouterr().out == f"{native_file('lever.dbc')}\n"


# --- errors ----------------------------------------------------------------------------------------------------------


@pytest.mark.usefixtures("commands")
@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["none"], "invalid choice: 'none'"),
        (["setings"], "invalid choice: 'setings': did you mean settings? (see `lever --help`)"),
        (["--none"], "(see `lever --help`)"),
        (["settings", "more"], "unrecognized arguments: more (see `lever --help`)"),
        (["settings", "--sett", "x"], "unrecognized arguments: --sett x"),
        (["settings", "--set"], "argument --set: expected one argument (see `lever settings --help`)"),
        (["settings", "--set", "m_p"], "'m_p' has no '=': write name = value"),
        (["settings", "--set", "m_p=x"], "m_p = 'x' is not a number (give it in kg, or with a unit: kg, g)"),
        (["settings", "--set", "m_p=100"], "m_p = 100.0 is out of range: it must be a number from 0.3 to 10 kg ("),
        (["settings", "--settings", "/none/x"], "/none/x: cannot be read: No such file or directory"),
        (["settings", "--json", "/none/x"], "cannot write /none/x: No such file or directory"),
        (["dbc", "--json", "/"], "cannot write /: it is a folder"),
        (["dbc", "--path", "--json", "x"], "argument --json: not allowed with argument --path"),
    ],
)
def test_bad_input_is_one_line(arguments: list[str], text: str, refused: Refused) -> None:
    assert text in refused(*arguments)


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["record", "--duration", "-1"], "argument --duration: '-1' is not a number of seconds above 0"),
        (["replay", "x", "--id-offset", "abc"], "argument --id-offset: 'abc' must be a number from 0 to 0x5e0"),
        (["qemu"], "the following arguments are required: IMAGE (see"),
    ],
)
def test_bad_input_names_the_option(arguments: list[str], text: str, refused: Refused) -> None:
    assert text in refused(*arguments)


@pytest.mark.parametrize(
    ("error", "status", "text"),
    [
        (LeverError("no such pilot"), 2, "lever: error: no such pilot\n"),
        (LeverError("two\nlines"), 2, "lever: error: two lines\n"),
        (PermissionError(13, "Permission denied", "/x"), 2, "lever: error: [Errno 13] Permission denied: '/x'\n"),
        (can.CanInitializationError("no such interface"), 2, "lever: error: no such interface\n"),
        (KeyboardInterrupt(), 130, "lever: interrupted\n"),
    ],
)
def test_errors_of_commands(
    error: BaseException, status: int, text: str, commands: list[Any], capsys: pytest.CaptureFixture[str]
) -> None:
    commands.append(entry("act", lambda: command_that(error)))
    assert main(["act"]) == status
    assert capsys.readouterr().err == text


def test_a_defect_is_not_hidden(commands: list[Any]) -> None:
    commands.append(entry("act", lambda: command_that(ZeroDivisionError("defect"))))
    with pytest.raises(ZeroDivisionError):
        main(["act"])


def test_reader_that_has_enough(installed: str) -> None:
    assert installed
    shell = f"{' '.join(LEVER)} dbc | true; echo ${{PIPESTATUS[0]}}"
    done = subprocess.run(["bash", "-c", shell], capture_output=True, text=True, check=False)
    assert (done.stdout, done.stderr) == ("1\n", "")


@pytest.mark.parametrize("arguments", [["sim", "--list"], ["settings"], ["--help"], ["replay", "-"]], ids=" ".join)
def test_a_closed_standard_output_is_one_line(arguments: list[str]) -> None:
    done = subprocess.run(
        ["bash", "-c", 'exec "$@" >&-', "-", LEVER_SCRIPT, *arguments], capture_output=True, text=True, check=False
    )
    said = "lever: error: standard output is closed: send it to a file or to /dev/null\n"
    assert (done.returncode, done.stderr) == (2, said)


def test_a_closed_standard_input_or_error_is_an_empty_one() -> None:
    command = ["bash", "-c", 'exec "$@" <&-', "-", LEVER_SCRIPT, "replay", "-"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (2, "", "lever: error: -: holds no CAN frame\n")
    command = ["bash", "-c", 'exec "$@" 2>&-', "-", LEVER_SCRIPT, "replay", "none.log"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (2, "", "")


# --- how commands are found ------------------------------------------------------------------------------------------


def test_own_run_and_shared_run(commands: list[Any]) -> None:
    def add_parser(subparsers: Any) -> None:
        subparsers.add_parser("one")
        subparsers.add_parser("two").set_defaults(run=lambda _args: 22)

    commands.append(entry("both", lambda: SimpleNamespace(add_parser=add_parser, run=lambda _args: 11)))
    assert main(["one"]) == 11
    assert main(["two"]) == 22


@pytest.mark.usefixtures("commands")
def test_broken_plug_in_does_not_take_the_others_along(commands: list[Any], capsys: pytest.CaptureFixture[str]) -> None:
    def broken() -> Any:
        raise ImportError("No module named 'plot'")

    commands.append(entry("broken", broken))
    assert main(["dbc", "--path"]) == 0
    assert capsys.readouterr().err == "lever: warning: no commands from somewhere.broken: No module named 'plot'\n"


def test_help_loads_nothing_heavy() -> None:
    code = (
        "import sys, importlib.metadata\n"
        "from lever_cdkf.cli.main import main\n"
        "main(['--help'])\n"
        "known = {'numpy', 'cffi', 'cantools', 'can', 'rich', 'scipy', 'plotly', 'textual', 'tornado'}\n"
        "heavy = known & set(sys.modules)\n"
        "print(' '.join(sorted(heavy)), file=sys.stderr, end='')\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
