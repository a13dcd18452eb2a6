"""Loaded by each interpreter under tests/mutation/host.py: puts a mutant in the place of a module, or notes which
functions run.

MUTANT_OF and MUTANT_TEXT: a file, and the file whose text is compiled in its place.
REACHED and REACHED_UNDER: a folder for the notes, and the folders whose functions count.
"""

from __future__ import annotations

import os
import sys
import threading
from functools import cache
from importlib.machinery import SourceFileLoader
from inspect import CO_OPTIMIZED
from types import CodeType, FrameType
from typing import Any

_get_code = SourceFileLoader.get_code
_noted: dict[int, CodeType] = {}
_folder = os.environ.get("REACHED", "")
_under = tuple(os.environ.get("REACHED_UNDER", "").split(os.pathsep))
_open, _real_path = open, cache(os.path.realpath)


def _code_with_mutant(loader: SourceFileLoader, name: str) -> CodeType | None:
    path = loader.get_filename(name)
    if os.path.realpath(path) != os.environ["MUTANT_OF"]:
        return _get_code(loader, name)
    with open(os.environ["MUTANT_TEXT"], encoding="utf-8") as file:
        return compile(file.read(), path, "exec", dont_inherit=True)


def _called(frame: FrameType, event: str, argument: Any) -> None:
    code = frame.f_code
    if id(code) in _noted:
        return
    path = _real_path(code.co_filename)
    if path.startswith(_under) and (code.co_flags & CO_OPTIMIZED or code.co_name == "<module>"):  # no body of a class
        try:
            with _open(f"{_folder}/{os.getpid()}", "a", encoding="utf-8") as file:
                file.write(f"{path}:{code.co_name}()\n")
        except OSError:  # a test lets no file grow
            return
    _noted[id(code)] = code


def note_in(folder: str) -> str:
    """Return what runs from now on, here and in processes started here, is noted in this folder; return that of
    before."""
    global _folder
    before = _folder
    os.makedirs(folder, exist_ok=True)
    os.environ["REACHED"] = _folder = folder
    _noted.clear()
    return before


if "MUTANT_OF" in os.environ:
    SourceFileLoader.get_code = _code_with_mutant  # type: ignore[method-assign,assignment]
if "REACHED" in os.environ:
    threading.settrace(_called)
    sys.settrace(_called)
