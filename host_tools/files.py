"""Files: where the package's own are, and how to write one that is never half written."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from lever_cdkf import host_tools

from .errors import LeverError

LIBRARY_DIR = "LEVER_CDKF_LIBRARY_DIR"
"""Environment variable for development: folders (separated like PATH) that are searched before the installed files."""


def native_file(name: str) -> Path:
    """The path of `name` (shared library, its declarations, lever.dbc), which installing has put into `_native`."""
    folders = [Path(folder) for folder in os.environ.get(LIBRARY_DIR, "").split(os.pathsep) if folder]
    folders += [Path(folder) / "_native" for folder in host_tools.__path__]  # two, if the install is editable
    for folder in folders:
        if (folder / name).is_file():
            return folder / name
    searched = ", ".join(str(folder) for folder in folders)
    raise LeverError(f"{name} is not in {searched}: install the package (pip install .) or set {LIBRARY_DIR}")


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Writes `text` as UTF-8 so that the file holds either all of it or what it held before. Raises LeverError.

    What is not a file (/dev/stdout, a named pipe) is written to as it is.
    """
    final = Path(path)
    in_place = final.exists() and not final.is_file()
    if not in_place:
        final = Path(os.path.realpath(final))  # of a symbolic link, the file and not the link is replaced
    target = final if in_place else final.with_name(f".{final.name}.{os.getpid()}.tmp")
    try:
        target.write_text(text, encoding="utf-8")
        if not in_place:
            os.replace(target, final)
    except OSError as error:
        raise LeverError(f"cannot write {path}: {error.strerror}") from None
    finally:
        if not in_place:
            with suppress(OSError):
                target.unlink()


def make_folder(folder: Path) -> None:
    """Makes a folder and those above it, where they are not there yet. Raises LeverError."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise LeverError(f"cannot make the folder {folder}: {error.strerror}") from None


def replace_file(path: Path, write: Callable[[Path], None]) -> None:
    """Has `write` write a file so that `path` holds either all of it or what it held before. Raises LeverError."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        write(temporary)
        os.replace(temporary, path)
    except OSError as error:
        raise LeverError(f"cannot write {path}: {error.strerror or error}") from None
    finally:
        temporary.unlink(missing_ok=True)
