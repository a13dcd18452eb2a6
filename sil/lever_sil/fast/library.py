"""The shared library of c/loop.h, and how arrays get into its structs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from lever_cdkf.firmware.library import ffi, load
from numpy.typing import NDArray

lib = load("lever_loop")


class Struct:
    """A struct of the library; keeps alive what its pointers point to."""

    def __init__(self, ctype: str) -> None:
        self.pointer: Any = ffi.new(f"{ctype} *")
        self._kept: list[Any] = []

    def array(self, ctype: str, values: NDArray[Any], dtype: Any) -> Any:
        """Return a pointer to the values, for a field of the struct.

        It is to a copy of them only where they are not as C has them.
        """
        contiguous = np.ascontiguousarray(values, dtype)
        return self.keep(ffi.from_buffer(f"{ctype}[]", contiguous))

    def keep(self, pointer: Any) -> Any:
        """Return the pointer, which lives as long as the struct."""
        self._kept.append(pointer)
        return pointer

    def kept(self) -> Sequence[Any]:
        """Return all arrays that its pointers point to."""
        return self._kept

    def cast(self, ctype: str, values: NDArray[np.float64]) -> Any:
        """Return a pointer of that type to an array of doubles."""
        return ffi.cast(ctype, self.doubles(values))

    def doubles(self, values: NDArray[np.float64]) -> Any:
        """Return the same, of the type double."""
        return self.array("double", values, np.float64)
