"""What is installed on demand: the extras of pyproject.toml, and the error text where one is missing."""

from __future__ import annotations

import importlib.util
import shlex
import sys
from collections.abc import Sequence

from ..errors import LeverError

PACKAGES = {
    "campaign": ("dask", "distributed", "pyarrow", "plotly", "matplotlib", "scipy"),
    "files": ("asammdf", "h5py", "mcap", "pyarrow", "scipy"),
    "flash": ("pyocd",),
    "fmu": ("fmpy",),
    "live": ("textual", "tornado"),
    "mf4": ("asammdf",),
    "report": ("plotly",),
    "study": ("plotly", "matplotlib", "scipy"),
    "tune": ("scipy",),
}
"""What each extra brings; imported by the same names."""


def missing(extra: str, *packages: str) -> str:
    """Return which packages of an extra, or of these alone, are not installed, and how to get them.

    Empty if all are.
    """
    needed = packages or PACKAGES[extra]
    if "asammdf" in needed:
        reveal_mf4()
    absent = [package for package in needed if not _is_installed(package)]
    return f"this needs {' and '.join(absent)}: {pip_install(f'lever-cdkf[{extra}]')}" if absent else ""


def pip_install(requirement: str) -> str:
    """Return the command that installs it where this Python finds it, whatever is on PATH."""
    return f'{shlex.quote(sys.executable)} -m pip install "{requirement}"'


def require(extra: str, *packages: str) -> None:
    """Raise LeverError where an extra, or these of its packages, are missing."""
    if reason := missing(extra, *packages):
        raise LeverError(reason)


def hide_mf4(arguments: Sequence[str]) -> None:
    """Hide asammdf, which python-can imports and which takes a second, from a command that reads no MF4 log.

    For the process of the command `lever` alone; a program that imports this package has python-can whole.
    """
    if not any(".mf4" in argument.lower() for argument in arguments):
        sys.modules.setdefault("asammdf", None)  # type: ignore[arg-type]


def mf4_is_hidden() -> bool:
    """Return whether hide_mf4() holds."""
    return sys.modules.get("asammdf", sys) is None


def reveal_mf4() -> None:
    """From here on `import asammdf` works again."""
    if mf4_is_hidden():
        del sys.modules["asammdf"]


def _is_installed(package: str) -> bool:
    try:
        return importlib.util.find_spec(package) is not None
    except ModuleNotFoundError:
        return False
