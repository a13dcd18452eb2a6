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
from types import CodeType, FrameType
from typing import Any

_get_code = SourceFileLoader.get_code


def _code_with_mutant(loader: SourceFileLoader, name: str) -> CodeType | None:
    path = loader.get_filename(name)
    if os.path.realpath(path) != os.environ["MUTANT_OF"]:
        return _get_code(loader, name)
    with open(os.environ["MUTANT_TEXT"], encoding="utf-8") as file:
        return compile(file.read(), path, "exec", dont_inherit=True)


def _note_functions() -> None:
    reached: set[CodeType] = set()
    folders = tuple(os.environ["REACHED_UNDER"].split(os.pathsep))

    def called(frame: FrameType, event: str, argument: Any) -> None:
        reached.add(frame.f_code)

    def write() -> None:
        sys.settrace(None)
        places = {(os.path.realpath(code.co_filename), code.co_firstlineno) for code in list(reached)}
        with open(os.path.join(os.environ["REACHED"], str(os.getpid())), "a", encoding="utf-8") as file:
            file.writelines(f"{path}:{line}\n" for path, line in places if path.startswith(folders))

    atexit.register(write)
    threading.settrace(called)
    sys.settrace(called)


if "MUTANT_OF" in os.environ:
    SourceFileLoader.get_code = _code_with_mutant  # type: ignore[method-assign,assignment]
if "REACHED" in os.environ:
    _note_functions()
