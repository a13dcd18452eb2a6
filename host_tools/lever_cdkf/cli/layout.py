"""Text in so many columns of a terminal: sentences and command lines. No word is broken, and nothing is cut."""

from __future__ import annotations

import os
import re
import shutil
import sys
import unicodedata

UNLIMITED = 100_000
_INDENT = "    "


def terminal_width() -> int:
    """Return the columns of standard output; without a limit where it is no terminal, so that `grep` has rows as lines.

    The environment variable COLUMNS sets it for both.
    """
    if not (sys.stdout.isatty() or os.environ.get("COLUMNS", "").isdecimal()):
        return UNLIMITED
    return shutil.get_terminal_size().columns


def text_width(text: str) -> int:
    """Return columns that a text takes: none for a combining dot, two for a wide letter."""
    return len(text) if text.isascii() else sum(map(_letter_width, text))


def _letter_width(letter: str) -> int:
    return 0 if unicodedata.combining(letter) else 1 + (unicodedata.east_asian_width(letter) in "WF")


def say(text: str) -> None:
    """Print a sentence, wrapped to the terminal."""
    print("\n".join(wrapped(text, terminal_width())))


def warn(text: str) -> None:
    """Print a warning to standard error, in one line."""
    print(f"lever: warning: {text}", file=sys.stderr)


def wrapped(text: str, width: int) -> list[str]:
    """Return lines of a text, broken at spaces, but not inside a unit. A longer word has a line of its own."""
    if text_width(text) <= width:
        return [text]
    lines: list[str] = []
    for word in words(text):
        if lines and text_width(f"{lines[-1]} {word}") <= width:
            lines[-1] += f" {word}"
        else:
            lines.append(word)
    return lines


def words(text: str) -> list[str]:
    """Return what is never broken."""
    return re.findall(r"[^ \[]*\[[^]]*\][^ ]*|\d+ %[^ ]*|[^ ]+", text)


def command_lines(command: str, width: int) -> list[str]:
    """Return a command line, continued by backslashes where it is too long; options keep their values."""
    lines: list[str] = []
    word = r"""(?:"[^"]*"|'[^']*'|[^\s"'])+"""
    for part in re.findall(rf"-\S+ (?!-){word}|{word}", command):
        if lines and text_width(f"{lines[-1]} {part}") <= width - len(" \\"):
            lines[-1] += f" {part}"
        else:
            lines.append(f"{_INDENT}{part}" if lines else part)
    return [f"{line} \\" for line in lines[:-1]] + lines[-1:]
