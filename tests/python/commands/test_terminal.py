"""What the commands print fits the terminal: no name and no number is cut, no word is broken."""

from __future__ import annotations

import contextlib
import fcntl
import itertools
import os
import pty
import re
import struct
import subprocess
import sys
import termios
import unicodedata
from collections.abc import Callable
from pathlib import Path

import pytest
import readmes
from lever_cdkf.cli.help_text import HelpFormatter
from lever_cdkf.cli.layout import command_lines, wrapped
from lever_cdkf.cli.main import main
from lever_cdkf.cli.tables import Row, print_tables
from processes import LEVER

Shown = Callable[..., str]
COMMANDS = (
    *("aircraft", "bounce", "campaign", "compare", "dbc", "demo", "envelope", "faults", "figures", "flash"),
    *("fmu", "live", "map", "monitor", "qemu", "record", "replay", "settings", "sim", "soak", "tune"),
)
ROWS: list[Row] = [
    {
        "name": f"natural_frequency_{row}",
        "unit": "rad/s",
        "estimate at the end [rad/s]": 1234.5678 * 10.0**-row,
        "count": 1_234_567 * row,
        "times to converge [s]": "0.3, 5.2, -",
        "largest difference of all [%]": None if row else 12.345,
        "remark": "z̈ of the base, measured by an accelerometer with a gain that is not known well " * row,
    }
    for row in range(4)
]


def columns(line: str) -> int:
    """Return the columns of a terminal: combining letters take none."""
    return sum(not unicodedata.combining(letter) for letter in line)


@pytest.fixture
def shown(installed: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Shown:
    """Return what a command prints on a terminal of some width."""
    assert installed

    def run(*arguments: str, width: int = 80) -> str:
        monkeypatch.setenv("COLUMNS", str(width))
        assert main(arguments) in (0, 1)
        return capsys.readouterr().out

    return run


def read_all(terminal: int) -> str:
    """Return what is written to a terminal until all have closed it."""
    text = b""
    with open(terminal, "rb", buffering=0) as stream, contextlib.suppress(OSError):
        while piece := stream.read(65536):
            text += piece
    return text.decode()


def assert_fits(text: str, width: int = 80) -> None:
    for line in text.splitlines():
        assert columns(line) <= width, line
    assert "…" not in text


@pytest.mark.parametrize("command", ["", *COMMANDS])
def test_help_fits(command: str, shown: Shown) -> None:
    names = [command] if command else []
    texts = {width: shown(*names, "--help", width=width) for width in (40, 80, 200)}
    for width, text in texts.items():
        assert max(map(columns, text.splitlines())) <= 80, width
    # No word is broken: each is found in wider help, too.
    assert set(texts[80].split()) - {"\\"} == set(texts[200].split()) - {"\\"}


def test_every_command_is_tried_here(shown: Shown) -> None:
    named = re.findall(r"^      (\w+)  ", shown("--help"), re.MULTILINE)
    assert set(named) == set(COMMANDS)


@pytest.mark.parametrize(
    "command",
    [
        "sim --list",
        "campaign --list",
        "compare --list",
        "compare --envelope --list",
        "bounce --list",
        "envelope --list",
        "faults --list",
        "figures --list",
        "settings",
        "dbc",
        "sim demo --set duration=6s --set converged_after=3s",
        "sim demo --set duration=6s --set converged_after=3s --seeds 2",
        "bounce --only alarm fault_clock --seeds 1 --out {folder}",
        "envelope --only rest_20s base_stuck --seeds 1 --out {folder}",
        "faults --only theta_stuck lever_crc --seeds 1",
        "compare --scenarios step_up --seeds 1 --duration 2",
        "compare --envelope --scenarios steady base_stuck --seeds 1 --estimators firmware",
        "monitor --scenario demo --once --duration 1",
    ],
)
def test_tables_fit(command: str, shown: Shown, tmp_path: Path) -> None:
    assert_fits(shown(*command.format(folder=os.path.relpath(tmp_path)).split()))


def test_what_is_made_of_a_log_fits(shown: Shown, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    shown("sim", "demo", "--set", "duration=21 s", "--out", "out")
    with open("out/trace.csv") as trace:
        Path("part.csv").write_text("".join(itertools.islice(trace, 4000)))
    for command in (
        "replay out/bus.log",
        "replay part.csv",
        "replay out/bus.log part.csv --each",
        "map part.csv",
        "tune out/bus.log" + "".join(f" --keep {name}" for name in readmes.KEPT.split()),
        "monitor --once out/bus.log",
    ):
        assert_fits(shown(*command.split()))


@pytest.mark.parametrize("width", [24, 40, 60, 80, 100, 200])
def test_a_table_keeps_all_its_cells(
    width: int, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", str(width))
    print_tables({"a title that is longer than the narrowest of these terminals": ROWS})
    text = capsys.readouterr().out
    assert_fits(text, max(width, columns("  times to converge  natural_frequency_0")))
    found = " ".join(text.split())
    for row in ROWS:
        for cell in (
            row["name"],
            str(row["count"]),
            f"{row['estimate at the end [rad/s]']:.4g}".replace("1.235e+03", ""),
        ):
            assert str(cell) in found
    assert "1235" in found
    assert found.count("accelerometer") == 6


def test_one_row_stands_upright(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    print_tables({"run": [{"samples": 3000, "mean NIS [1]": 1.98765, "time [s]": 0.25, "bias [%]": None}]})
    lines = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert lines == [["run"], ["samples", "3000"], ["mean", "NIS", "1.988"], ["time", "0.25", "s"], ["bias", "-"], []]


@pytest.mark.parametrize("width", [20, 40, 80])
def test_numbers_of_one_row_stay_whole(
    width: int, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", str(width))
    print_tables({"run": [{"count of all samples": 1234567890123456, "remark": "of the base, and of the lever " * 3}]})
    lines = capsys.readouterr().out.splitlines()
    assert lines[1] == "  count of all samples  1234567890123456"
    assert " ".join(" ".join(lines[2:]).split()) == ("remark" + " of the base, and of the lever" * 3)
    assert_fits("\n".join(lines), max(width, columns("  count of all samples  ") + 32))


@pytest.mark.parametrize("width", [40, 70, 80, 90])
def test_a_long_word_stays_whole(
    width: int, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A sparkline, or the path of a file, beside a number and beside prose."""
    monkeypatch.setenv("COLUMNS", str(width))
    word, prose = "▁▂▃▄▅▆▇█" * 5, "of the base, and of the lever " * 3
    print_tables({"signals": [{"name": name, "mean [rad]": 1.2345, "plot": word, "why": prose} for name in "ab"]})
    text = capsys.readouterr().out
    assert text.count(word) == text.count("1.234") == 2
    assert "…" not in text


def test_a_heading_is_not_folded_inside_a_unit(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "40")
    print_tables(
        {"run": [{"name": name, "damping of the arm [N s/m]": 1.5, "of the lever [N m]": 2.5} for name in "ab"]}
    )
    heading = capsys.readouterr().out.split("─")[0]
    assert "[N s/m]" in heading
    assert "[N m]" in heading


def test_numbers_have_four_digits_and_counts_all(capsys: pytest.CaptureFixture[str]) -> None:
    numbers = [2094.5678, 0.0123456, 123456.7, 1e-5, 5.0, 1.5e12]
    print_tables({"numbers": [{"n": number, "count": 1234567} for number in numbers]})
    rows = [line.split() for line in capsys.readouterr().out.splitlines()[3:-1]]
    assert [row[0] for row in rows] == ["2095", "0.01235", "123457", "1e-05", "5", "1.5e+12"]
    assert {row[1] for row in rows} == {"1234567"}


def test_a_pipe_has_a_row_in_each_line_and_a_terminal_its_width(tmp_path: Path) -> None:
    environment = {name: value for name, value in os.environ.items() if name != "COLUMNS"}
    piped = subprocess.run([LEVER, "dbc"], capture_output=True, text=True, check=True, env=environment).stdout
    assert re.search(r"^LEVER_SAMPLE +theta +16 .* Lever angle from the floor", piped, re.MULTILINE)
    parent, child = pty.openpty()
    fcntl.ioctl(child, termios.TIOCSWINSZ, struct.pack("4H", 24, 60, 0, 0))
    with subprocess.Popen([LEVER, "dbc"], stdin=child, stdout=child, env=environment) as run:
        os.close(child)
        text = read_all(parent)
    assert run.returncode == 0
    assert "Lever angle from the floor" in text
    assert "\x1b" not in text
    assert_fits(text, 60)


def test_an_encoding_that_has_not_all_letters() -> None:
    environment = {**os.environ, "PYTHONIOENCODING": "ascii", "PYTHONUTF8": "0", "LC_ALL": "C"}
    commands = ("--help", "envelope --list", "monitor --once --scenario demo --duration 0.3")
    each = "; ".join(f"assert main({command.split()}) == 0" for command in commands)
    program = [sys.executable, "-c", f"from lever_cdkf.cli.main import main; {each}"]
    done = subprocess.run(program, capture_output=True, check=False, env=environment)
    assert (done.returncode, done.stderr) == (0, b"")


def test_text_is_broken_at_spaces_only() -> None:
    assert wrapped("share of the time [rad / s], 5 % of it", 12) == ["share of the", "time", "[rad / s],", "5 % of it"]
    assert wrapped("a_name_that_is_long and more", 8) == ["a_name_that_is_long", "and more"]
    command = "lever sim demo --set 'duration=6 s' --out a/b --realtime"
    assert command_lines(command, 80) == [command]
    assert command_lines(command, 32) == [
        "lever sim demo \\",
        "    --set 'duration=6 s' \\",
        "    --out a/b --realtime",
    ]


def test_help_keeps_paragraphs_lists_and_commands() -> None:
    text = "One sentence that is too long.\nAnd a second.\n\n  key  what it is, in words\n  lever sim --out DIR --a 1\n"
    assert HelpFormatter("x")._fill_text(text, 24, "").splitlines() == [
        "One sentence that is too",
        "long. And a second.",
        "",
        "  key  what it is, in",
        "       words",
        "  lever sim --out DIR \\",
        "      --a 1",
    ]
    goes_on = "  lever qemu image -- \\\n      lever sim steady --bus x\n"
    assert HelpFormatter("x")._fill_text(goes_on, 24, "").splitlines() == [
        "  lever qemu image -- \\",
        "      lever sim steady \\",
        "          --bus x",
    ]
