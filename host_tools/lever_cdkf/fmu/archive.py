"""An FMU as a file: everything in it is made in a folder, then put into an archive."""

from __future__ import annotations

import shutil
import tempfile
import zipfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib.resources import files
from pathlib import Path

from ..errors import LeverError
from ..runtime.files import check_writable, native_file, shared_library, whole
from ..runtime.provenance import created, provenance
from .binary import compile_library, compiler, headers, platform_tuple
from .description import Model, build_description, model_description

_LICENCE = "MIT; the text is in the file LICENSE of Lever CDKF.\n"
_FMI = ("fmi3.c", "fmi3_state.c", "fmi3_unused.c", "fmi3_values.c", "fmu.h")
"""What every FMU has, in c/ beside this file."""


@dataclass(frozen=True)
class Contents:
    """What goes into an FMU besides what every one has."""

    model: Model
    c: Mapping[str, Path]
    """Files of C, by their path below sources/."""
    config: str
    """More of fmu_config.h than token and start values."""
    page: str
    """Content of documentation/index.html."""
    resources: Mapping[str, bytes]
    """By file name."""
    more: Mapping[str, bytes] = field(default_factory=dict)
    """Further files by their path in the FMU."""


def own_c(package: str, names: Iterable[str]) -> dict[str, Path]:
    """Return files in the folder c/ of a package, by their names."""
    folder = Path(str(files(package))) / "c"
    return {name: folder / name for name in names}


def core_c(*folders: str) -> dict[str, Path]:
    """Return the C of the estimator core by its path: all of it, or only the headers and what is in these folders."""
    root = native_file("sources/lever_cdkf.h").parent
    found = {path.relative_to(root).as_posix(): path for path in sorted(root.rglob("*")) if path.is_file()}
    return {
        name: path for name, path in found.items() if not folders or not name.endswith(".c") or name.startswith(folders)
    }


def check(path: Path) -> None:
    """Raise LeverError for what would fail at the end of write()."""
    check_writable(path)
    if path.suffix.lower() != ".fmu":
        raise LeverError(f"cannot write {path}: the name of an FMU ends in .fmu")
    headers()
    compiler()


def write(path: Path, contents: Contents) -> None:
    """Write an FMU. Raise LeverError."""
    with tempfile.TemporaryDirectory(prefix="lever.") as name:
        folder = Path(name)
        _fill(folder, contents)
        with whole(path) as target, zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
            for file in sorted(each for each in folder.rglob("*") if each.is_file()):
                information = zipfile.ZipInfo(file.relative_to(folder).as_posix(), created().timetuple()[:6])
                information.compress_type = zipfile.ZIP_DEFLATED
                information.external_attr = 0o644 << 16
                archive.writestr(information, file.read_bytes())


def _fill(folder: Path, contents: Contents) -> None:
    sources = folder / "sources"
    c = own_c(__package__, _FMI) | dict(contents.c)
    for name, origin in c.items():
        (sources / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(origin, sources / name)
    compiled = [name for name in c if name.endswith(".c")]
    content = [origin.read_bytes() for origin in c.values()]
    model = contents.model.with_token(contents.config.encode(), *content, *contents.resources.values())
    (sources / "fmu_config.h").write_text(_config(model, contents.config), encoding="utf-8")
    (sources / "buildDescription.xml").write_bytes(build_description(model.identifier, compiled))
    (folder / "modelDescription.xml").write_bytes(model_description(model))
    library = (
        folder / "binaries" / platform_tuple() / f"{model.identifier}{Path(shared_library(model.identifier)).suffix}"
    )
    compile_library(sources, compiled, library)
    _write_all(
        folder / "documentation", {"index.html": contents.page.encode(), "licenses/LICENSE.txt": _LICENCE.encode()}
    )
    _write_all(folder / "extra/lever_cdkf", {"provenance.json": provenance().text().encode()})
    _write_all(folder / "resources", contents.resources)
    _write_all(folder, contents.more)


def _write_all(folder: Path, content: Mapping[str, bytes]) -> None:
    for name, data in content.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(data)


def _config(model: Model, more: str) -> str:
    return (
        "/* What this FMU was made with. Written by `lever fmu`: do not edit. */\n"
        f'#define FMU_TOKEN "{model.token}"\n'
        f"#define FMU_START_VALUES {_numbers(variable.start for variable in model.variables)}\n{more}"
    )


def _numbers(values: Iterable[float]) -> str:
    return ", ".join(repr(float(value)) for value in values)


def c_string(text: str) -> str:
    """Return a string literal of C."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'


def float_list(values: Sequence[float]) -> str:
    """Return an initialiser of an array of float, exact to the bit."""
    return "{" + ", ".join(f"{float(value)!r}f" for value in values) + "}"
