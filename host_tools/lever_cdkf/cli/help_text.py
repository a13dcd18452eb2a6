"""Help of the command `lever`, in the columns of the terminal, at most 80."""

from __future__ import annotations

import argparse
import re
from collections.abc import Iterator

from .layout import command_lines, wrapped

_WIDTH = 80
_INDENT = "      "
_ITEM = re.compile(r"(\s+)(\S.*?)(?:\s{2,}(\S.*))?")
"""Indented: a term or a command, and what it is, after two spaces or more."""


class HelpFormatter(argparse.HelpFormatter):
    """Descriptions keep their paragraphs, lists and commands; nothing is broken inside a word."""

    def __init__(self, prog: str) -> None:
        super().__init__(prog)
        self._width = min(self._width, _WIDTH)

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        return "".join(f"{indent}{line}\n" for line in _lines(text.rstrip("\n"), width))

    def _split_lines(self, text: str, width: int) -> list[str]:
        return wrapped(" ".join(text.split()), width)


def _lines(text: str, width: int) -> Iterator[str]:
    for part in _joined(text):
        item = _ITEM.fullmatch(part)
        left = part[: item.start(3)] if item and item[3] else ""
        if item is None:
            yield from wrapped(part, width)
        elif not left:
            yield from [part] if len(part) <= width else _command(item[2], width, item[1])
        elif len(left) <= width // 2:
            first, *others = wrapped(item[3], width - len(left))
            yield left + first
            yield from (" " * len(left) + line for line in others)
        else:
            yield from _command(item[2], width)
            yield from (_INDENT + line for line in wrapped(item[3], width - len(_INDENT)))


def _command(text: str, width: int, indent: str = "  ") -> Iterator[str]:
    return (f"{indent}{line}" for line in command_lines(text, width - len(indent)))


def _joined(text: str) -> list[str]:
    """Return the lines of a text: those of a paragraph as one, and those of an entry of a list."""
    parts: list[str] = []
    for line in text.split("\n"):
        indent = len(line) - len(line.lstrip())
        goes_on = bool(parts and parts[-1] and line) and (
            indent == 0 == len(parts[-1]) - len(parts[-1].lstrip()) or indent > 2 * len(_INDENT)
        )
        if goes_on:
            parts[-1] += f" {line.strip()}"
        else:
            parts.append(line)
    return parts
