"""The firmware's shared library through cffi: `ffi` and `lib` are the façade firmware/lever_cdkf.h, their manual.

Importing takes about 50 ms (cffi reads the header); a library that is not there is a LeverError.
"""

from __future__ import annotations

import re
from functools import cache
from typing import TYPE_CHECKING, Any

import cffi

from ..errors import LeverError
from ..runtime.files import native_file, shared_library

if TYPE_CHECKING:
    import numpy as np

ffi: Any = cffi.FFI()


@cache
def load(library: str) -> Any:
    """Return the functions of a shared library; raise LeverError.

    What installing has made of its header declares them.
    """
    ffi.cdef(native_file(f"{library}_cdef.h").read_text(encoding="utf-8"))
    path = native_file(shared_library(library))
    try:
        return ffi.dlopen(str(path))
    except OSError as error:
        raise LeverError(f"cannot load {path}: {error}") from None


lib = load("lever_cdkf")


@cache
def enum_names(enum: str) -> dict[int, str]:
    """Return value to name of a façade enum, in lower case without prefix: enum_names("lever_mode") is {0: "init", …}.

    The prefix is the enum's name, or that without its last word (LEVER_PLATFORM_CLOCK of enum lever_platform_fault).
    """
    elements = {value: name.lower() for value, name in ffi.typeof(f"enum {enum}").elements.items()}
    prefix = enum if all(name.startswith(f"{enum}_") for name in elements.values()) else enum.rpartition("_")[0]
    names = {value: name.removeprefix(f"{prefix}_") for value, name in sorted(elements.items())}
    return {value: name for value, name in names.items() if name != "count"}


@cache
def enum_words(enum: str) -> dict[str, str]:
    """Return what the façade header says of each member of an enum, by its name of enum_names()."""
    header = native_file("lever_cdkf_cdef.h").read_text(encoding="utf-8")
    body = header.partition(f"enum {enum} {{")[2].partition("}")[0]
    comments = re.findall(r"= (\d+),?\s*/\*(.*?)\*/", body, re.DOTALL)
    names = enum_names(enum)
    return {names[int(value)]: " ".join(comment.split()) for value, comment in comments}


def struct_dtype(ctype: str) -> np.dtype[Any]:
    """Return the numpy dtype of a struct, padding included."""
    import numpy as np

    struct = ffi.typeof(ctype)
    names, formats, offsets = [], [], []
    for name, field in struct.fields:
        shape: tuple[int, ...] = ()
        kind = field.type
        while kind.kind == "array":
            shape, kind = (*shape, kind.length), kind.item
        names.append(name)
        formats.append((_scalar(kind), shape) if shape else _scalar(kind))
        offsets.append(field.offset)
    return np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": ffi.sizeof(struct)})


def _scalar(kind: Any) -> str:
    """Return numpy's name of a number or enum."""
    if kind.cname == "_Bool":
        return "bool"
    letter = "f" if kind.cname in ("float", "double") else "i" if kind.cname.startswith("int") else "u"
    return f"{letter}{ffi.sizeof(kind)}"
