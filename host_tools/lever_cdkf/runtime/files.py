"""Files: where the package's own are, and how to write one that is never half written."""

from __future__ import annotations

import json
import os
import shutil
import sys
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, redirect_stdout, suppress
from pathlib import Path
from typing import Any, TextIO

import lever_cdkf

from ..errors import LeverError
from . import interrupts

LIBRARY_DIR = "LEVER_CDKF_LIBRARY_DIR"
"""Environment variable for development: folders (separated like PATH) that are searched before the installed files."""
STANDARD_OUTPUT = "-"
_output: TextIO | None = None  # standard output, inside prints_aside()


def native_file(name: str) -> Path:
    """Return the path of a file that installing has put into `_native`.

    Parameters
    ----------
    name
        A shared library, its declarations, or "lever.dbc".

    Returns
    -------
    Path
        The first of that name in the folders of LEVER_CDKF_LIBRARY_DIR and of the package.

    Raises
    ------
    LeverError
        There is none: the package is not installed.
    """
    folders = [Path(folder) for folder in os.environ.get(LIBRARY_DIR, "").split(os.pathsep) if folder]
    folders += [Path(folder) / "_native" for folder in lever_cdkf.__path__]  # two, if the install is editable
    for folder in folders:
        if (folder / name).is_file():
            return folder / name
    searched = ", ".join(str(folder) for folder in folders)
    raise LeverError(f"{name} is not in {searched}: install the package (pip install .) or set {LIBRARY_DIR}")


def shared_library(name: str) -> str:
    """Return the file name of a shared library on this system."""
    return {"darwin": f"lib{name}.dylib", "win32": f"{name}.dll"}.get(sys.platform, f"lib{name}.so")


@contextmanager
def prints_aside() -> Iterator[None]:
    """Inside, what is printed goes to standard error, and the text of the file "-" to standard output."""
    global _output
    _output = sys.stdout
    try:
        with redirect_stdout(sys.stderr):
            yield
    finally:
        _output = None


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Write `text` as UTF-8, as whole() does. Raise LeverError."""
    write_texts({Path(path): text})


def json_text(content: Any) -> str:
    """Return a file of JSON. Raise ValueError for NaN and infinity, which JSON does not have."""
    return json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def write_texts(texts: Mapping[Path, str]) -> None:
    """Write files, all or none, but for what fails when all are written; then print "-". Raise LeverError."""
    files = dict(texts)
    printed = "" if _output is None else files.pop(Path(STANDARD_OUTPUT), "")
    with ExitStack() as stack:
        for path, text in files.items():
            target = stack.enter_context(whole(path))
            with writing(path):
                target.write_text(text, encoding="utf-8")
    if _output is not None:
        _output.write(printed)


def check_writable(path: str | os.PathLike[str]) -> None:
    """Raise LeverError where whole() could not write: before work that would be lost."""
    final = Path(path)
    if final.is_dir():
        raise LeverError(f"cannot write {path}: it is a folder")
    if final.is_file() or not final.exists():
        with writing(final), tempfile.TemporaryFile(dir=Path(os.path.realpath(path)).parent):
            pass


@contextmanager
def whole(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Where to write so that the file `path` holds either all of it or what it held before. Raise LeverError.

    What is not a file (/dev/stdout, a named pipe) is written to as it is.
    """
    final = Path(path)
    in_place = final.exists() and not final.is_file()
    if not in_place:
        final = Path(os.path.realpath(final))  # of a symbolic link, the file and not the link is replaced
    target = final if in_place else final.with_name(f".{final.name}.{os.getpid()}.tmp")
    try:
        with writing(Path(path)):
            yield target
            if not in_place:
                os.replace(target, final)
    finally:
        if not in_place:
            with suppress(OSError):
                target.unlink()


@contextmanager
def made_folder(folder: Path | None) -> Iterator[None]:
    """Make a folder and those above it, where they are not there yet; None: do nothing. Raise LeverError.

    Those that it has made and that are empty at the end are removed: a command that fails leaves none behind.
    """
    if folder is None:
        yield
        return
    missing = [each for each in (folder, *folder.parents) if not each.exists()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        why = "there is a file of that name" if folder.is_file() else error.strerror
        raise LeverError(f"cannot make the folder {folder}: {why}") from None
    try:
        yield
    finally:
        with suppress(OSError):  # of the first that is not empty
            for each in missing:
                each.rmdir()


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Raise LeverError, which names `path`, for an OSError inside."""
    try:
        yield
    except OSError as error:
        raise LeverError(f"cannot write {path}: {error.strerror or error}") from None


def check_not_input(path: str | os.PathLike[str] | None, inputs: Iterable[str | os.PathLike[str]]) -> None:
    """Raise LeverError when writing to `path` would overwrite one of `inputs`."""
    with suppress(OSError):  # one of them is not there
        if path is not None and any(os.path.samefile(path, each) for each in inputs if os.path.exists(each)):
            raise LeverError(f"cannot write {path}: it is an input: choose another folder or name")


class Growing:
    """A file that is written a piece at a time; complete after close()."""

    def __init__(self, path: Path) -> None:
        """Begin it. Raise LeverError."""
        self._path = path
        with writing(path):
            self._file = path.open("wb")

    def close(self) -> None:
        """Complete it. Raise LeverError."""
        with writing(self._path):
            self._finish()
            self._file.close()

    def abandon(self) -> None:
        """Let go of it."""
        with suppress(OSError):
            self._file.close()

    def _finish(self) -> None:
        """Write what stands at its end."""


class Outputs:
    """The files of a command in a folder, put into place together when all are whole.

    Until then they are in a hidden folder in it. A context manager; without finish() it leaves what was there before,
    and nothing else.
    """

    def __init__(self, folder: Path, inputs: Iterable[str | os.PathLike[str]] = (), names: Iterable[str] = ()) -> None:
        """Protect `inputs` of the command from being written over.

        finish() removes the files among `names` that an earlier run has left and this one has not made.
        """
        self._folder = folder
        self._may_be_there = tuple(names)
        self._unfinished = folder
        self._inputs = list(inputs)
        self._names: list[str] = []
        self._made = ExitStack()

    def __enter__(self) -> Outputs:
        with ExitStack() as stack:
            stack.enter_context(made_folder(self._folder))
            with writing(self._folder):
                self._unfinished = Path(tempfile.mkdtemp(".tmp", ".lever.", self._folder))
            stack.callback(shutil.rmtree, self._unfinished, ignore_errors=True)
            self._made = stack.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        self._made.close()

    def path(self, name: str) -> Path:
        """Where to write the file `name`. Raise LeverError when in its place is an input, or a folder."""
        final = self._folder / name
        check_not_input(final, self._inputs)
        if final.is_dir():
            raise LeverError(f"cannot write {final}: it is a folder")
        self._names.append(name)
        return self._unfinished / name

    def written(self, *names: str) -> list[Path]:
        """Where those of these files are that have been asked for."""
        return [self._unfinished / name for name in names if name in self._names]

    def finish(self) -> None:
        """Put the files into their place; the last one asked for is there only when all are. Raise LeverError."""
        interrupts.check()
        with writing(self._folder):
            (self._folder / self._names[-1]).unlink(missing_ok=True)
            for name in set(self._may_be_there) - set(self._names):
                (self._folder / name).unlink(missing_ok=True)
            for name in self._names:
                os.replace(self._unfinished / name, self._folder / name)
