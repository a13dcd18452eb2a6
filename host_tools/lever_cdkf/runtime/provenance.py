"""Where an output comes from: version, revision, date, command line, and the hash of each input file."""

from __future__ import annotations

import hashlib
import html
import importlib.metadata
import json
import os
import re
import shlex
import sys
import textwrap
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field, replace
from datetime import datetime, timezone
from functools import cache
from pathlib import Path
from typing import Any

from ..errors import LeverError
from .files import native_file, shared_library

SOFTWARE = "lever-cdkf"
_DATE = "%Y-%m-%dT%H:%M:%SZ"
_WRAPPED = textwrap.TextWrapper(120, subsequent_indent="  ", break_on_hyphens=False)
"""No line of a settings file has more than 510 bytes, which is room for 120 characters of four bytes each."""


@dataclass(frozen=True)
class Provenance:
    """Of the files of one command."""

    version: str
    """Of the package."""
    revision: str | None
    """Of the source tree that it runs from, or was installed from, with -dirty where files had changed; None for one
    that was installed from a source distribution."""
    library: str
    """SHA-256 of the firmware's shared library."""
    created: str
    """UTC; SOURCE_DATE_EPOCH in its place, where that is set."""
    command: str
    inputs: dict[str, str | None]
    """SHA-256 of each input file by its path as given; None where it cannot be read again, as standard input."""
    outputs: dict[str, str | None] = field(default_factory=dict)
    """SHA-256 of those files beside this one that cannot hold their own provenance."""

    def moment(self) -> datetime:
        """Return `created` as a date."""
        return datetime.strptime(self.created, _DATE).replace(tzinfo=timezone.utc)

    def with_outputs(self, paths: Iterable[Path]) -> Provenance:
        """And of these files."""
        return replace(self, outputs={path.name: sha256(path) for path in paths})

    def content(self) -> dict[str, Any]:
        """For JSON."""
        return {"software": SOFTWARE, **asdict(self)}

    def text(self) -> str:
        """Return the content of provenance.json."""
        return json.dumps(self.content(), indent=2, ensure_ascii=False) + "\n"

    def comment(self) -> str:
        """As lines that begin with #, short enough for every reader of settings and responses."""
        generator = f"{SOFTWARE} {self.version}{f' ({self.revision})' if self.revision else ''}, {self.created}"
        hashes = [f"{path} {digest or '(not a file)'}" for path, digest in self.inputs.items()]
        lines = (part for line in (generator, self.command, *hashes) for part in _WRAPPED.wrap(line))
        return "".join(f"# {line}\n" for line in lines)

    def properties(self, **more: Any) -> dict[str, str]:
        """Return name and text of each property, for formats that keep pairs of text.

        `more` are further ones, as JSON.
        """
        given = {name: value for name, value in asdict(self).items() if value}
        return {"software": SOFTWARE} | {name: _as_text(value) for name, value in (given | more).items()}


def provenance(inputs: Iterable[str | os.PathLike[str]] = ()) -> Provenance:
    """Return the provenance of this process, now; `inputs` are the files that it reads.

    Raise LeverError for a SOURCE_DATE_EPOCH that is no number.
    """
    return Provenance(
        version=version(),
        revision=revision(),
        library=_library(),
        created=created().strftime(_DATE),
        command=printable(shlex.join([Path(sys.argv[0]).name, *sys.argv[1:]])),
        inputs={printable(str(path)): sha256(path) for path in inputs},
    )


def with_provenance(page: str, origin: Provenance | None) -> str:
    """HTML with its provenance at the end, as a list to be opened, and as JSON in the element `provenance`."""
    if origin is None:
        return page
    properties = origin.properties()
    items = "".join(f"<dt>{html.escape(name)}</dt><dd>{html.escape(text)}</dd>" for name, text in properties.items())
    generator = html.escape(f"{properties['software']} {properties['version']}, {properties['created']}")
    shown = f'<footer><details class="origin"><summary>{generator}</summary><dl>{items}</dl></details></footer>'
    content = json.dumps(properties, ensure_ascii=False).replace("</", "<\\/")
    kept = f'<script type="application/json" id="provenance">{content}</script>\n'
    head, end, tail = page.rpartition("</body>" if "</body>" in page else "</html>")
    return f"{head}{shown}{kept}{end}{tail}"


def version() -> str:
    """Return the version of the installed package."""
    try:
        return importlib.metadata.version(SOFTWARE)
    except importlib.metadata.PackageNotFoundError:
        return "(not installed)"


def created() -> datetime:
    """Now, or what SOURCE_DATE_EPOCH says. Raises LeverError."""
    epoch = os.environ.get("SOURCE_DATE_EPOCH")
    if not epoch:
        return datetime.now(tz=timezone.utc)
    try:
        return datetime.fromtimestamp(int(epoch), tz=timezone.utc)
    except (ValueError, OverflowError, OSError):
        raise LeverError(f"SOURCE_DATE_EPOCH = {epoch!r}: it must be seconds since 1970") from None


@cache
def revision() -> str | None:
    """Return the revision of the git tree that the package is in, or that it was installed from."""
    import subprocess

    file = Path(__file__).resolve()
    root = file.parents[3]
    if file.parents[2].name != "host_tools":
        return _installed_revision()
    if not (root / ".git").exists():
        return None
    command = [
        "git",
        "--no-optional-locks",
        "-C",
        str(root),
        "describe",
        "--always",
        "--dirty",
        "--abbrev=12",
        "--match=",
    ]
    try:
        described = subprocess.run(command, capture_output=True, text=True, check=True, timeout=10.0)
    except (OSError, subprocess.SubprocessError):
        return None
    return described.stdout.strip() or None


def _installed_revision() -> str | None:
    """Return what firmware/CMakeLists.txt has noted at the installation."""
    try:
        return native_file("revision.txt").read_text(encoding="utf-8").strip() or None
    except (LeverError, OSError):
        return None


@cache
def _library() -> str:
    return sha256(native_file(shared_library("lever_cdkf"))) or ""


def sha256(path: str | os.PathLike[str]) -> str | None:
    """Of the content of a file; None for what is not a file, or cannot be read."""
    digest = hashlib.sha256()
    try:
        if not Path(path).is_file():
            return None
        with open(path, "rb") as file:
            while piece := file.read(1 << 20):
                digest.update(piece)
    except OSError:
        return None
    return f"sha256:{digest.hexdigest()}"


def printable(text: str) -> str:
    """Return a name as every format can hold it: other bytes than UTF-8, and control characters, in hexadecimal."""
    whole = text.encode("utf-8", "backslashreplace").decode("utf-8")
    return re.sub(r"[\x00-\x1f\x7f]", lambda match: f"\\x{ord(match[0]):02x}", whole)


def _as_text(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value, ensure_ascii=False, allow_nan=False)
