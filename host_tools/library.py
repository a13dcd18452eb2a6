"""The firmware's shared library through cffi: `ffi` and `lib` are the façade firmware/lever_cdkf.h, their manual.

Importing takes about 50 ms (cffi reads the header); a library that is not there is a LeverError.
"""

from __future__ import annotations

import sys
from functools import cache
from typing import Any

import cffi

from .errors import LeverError
from .files import native_file

_LIBRARY = {"darwin": "liblever_cdkf.dylib", "win32": "lever_cdkf.dll"}.get(sys.platform, "liblever_cdkf.so")


def _load() -> tuple[Any, Any]:
    loaded = cffi.FFI()
    loaded.cdef(native_file("lever_cdkf_cdef.h").read_text(encoding="utf-8"))
    path = native_file(_LIBRARY)
    try:
        return loaded, loaded.dlopen(str(path))
    except OSError as error:
        raise LeverError(f"cannot load {path}: {error}") from None


ffi, lib = _load()


@cache
def enum_names(enum: str) -> dict[int, str]:
    """Value to name of a façade enum, in lower case without prefix: enum_names("lever_mode") is {0: "init", …}.

    The prefix is the enum's name, or that without its last word (LEVER_PLATFORM_CLOCK of enum lever_platform_fault).
    """
    elements = {value: name.lower() for value, name in ffi.typeof(f"enum {enum}").elements.items()}
    prefix = enum if all(name.startswith(f"{enum}_") for name in elements.values()) else enum.rpartition("_")[0]
    names = {value: name.removeprefix(f"{prefix}_") for value, name in sorted(elements.items())}
    return {value: name for value, name in names.items() if name != "count"}
