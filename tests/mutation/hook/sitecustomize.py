"""Loaded by each interpreter under tests/mutation/host.py: puts a mutant in the place of a module, or notes which
functions run.

MUTANT_OF and MUTANT_TEXT: a file, and the file whose text is compiled in its place.
REACHED and REACHED_UNDER: a folder for the notes, and the folders whose functions count.
"""

from __future__ import annotations

import atexit
import os
import sys
import threading
from importlib.machinery import SourceFileLoader
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

_get_code = SourceFileLoader.get_code
_reached: set[CodeType] = set()


def _code_with_mutant(loader: SourceFileLoader, name: str) -> CodeType | None:
    path = loader.get_filename(name)
    if os.path.realpath(path) != os.environ["MUTANT_OF"]:
        return _get_code(loader, name)
    with open(os.environ["MUTANT_TEXT"], encoding="utf-8") as file:
        return compile(file.read(), path, "exec", dont_inherit=True)


def _called(frame: FrameType, event: str, argument: Any) -> None:
    _reached.add(frame.f_code)


def note_in(folder: str) -> str:
    """What runs from now on, here and in processes started here, is noted in this folder; returns that of before."""
    before = os.environ["REACHED"]
    under = tuple(os.environ["REACHED_UNDER"].split(os.pathsep))
    codes = list(_reached)
    _reached.clear()
    places = {(os.path.realpath(code.co_filename), code.co_firstlineno) for code in codes}
    with open(os.path.join(before, str(os.getpid())), "a", encoding="utf-8") as file:
        file.writelines(f"{path}:{line}\n" for path, line in places if path.startswith(under))
    Path(folder).mkdir(exist_ok=True)
    os.environ["REACHED"] = folder
    return before


def _note_the_last() -> None:
    sys.settrace(None)
    note_in(os.environ["REACHED"])


if "MUTANT_OF" in os.environ:
    SourceFileLoader.get_code = _code_with_mutant  # type: ignore[method-assign,assignment]
if "REACHED" in os.environ:
    atexit.register(_note_the_last)
    threading.settrace(_called)
    sys.settrace(_called)
