"""What the façade header, the map of the folders and the flags promise of the core, seen from outside the code."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from quality import tools

FACADE = tools.FIRMWARE / "lever_cdkf.h"
HEADERS = [file for folder in tools.CORE for file in sorted((tools.FIRMWARE / folder).glob("*.h"))]
MAY_INCLUDE = {
    "math": {"math"},
    "model": {"model", "math"},
    "filter": {"filter", "model", "math"},
    "can": {"can", "model", "math"},
    "bounce": {"bounce", "filter", "model", "math"},
    "app": {"app", "bounce", "filter", "can", "model", "math"},
}
PORT_MAY_INCLUDE = {
    "linux": {"port", "port/linux", "port/slcan", "can/messages.h"},
    "slcan": {"port/slcan", "port/identifiers.h"},
    "build": {"port/linux"},
    "embedded": {"port/embedded"},
    "stm32f4": {"port", "port/stm32f4", "port/embedded", "port/slcan", "can/messages.h", "can/e2e.h"},
}
SYSTEM_HEADERS = {"math.h", "stdbool.h", "stddef.h", "stdint.h", "string.h"}
LIBRARY_FUNCTIONS = {"memcpy", "memmove", "memset", "sqrtf"}
C99 = ("-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-fsyntax-only")


def functions_of_the_facade() -> set[str]:
    declaration = re.compile(r"^[a-z_][\w ]*[ *](lever_\w+)\(", re.MULTILINE)
    return set(declaration.findall(FACADE.read_text(encoding="utf-8")))


def symbols(file: Path, *options: str) -> set[str]:
    output = tools.run(["nm", *options, file]).stdout
    return {line.split()[-1] for line in output.splitlines() if line.strip() and not line.endswith(":")}


@pytest.mark.requires("cc|gcc|clang")
@pytest.mark.parametrize("header", [FACADE, *HEADERS], ids=lambda header: header.name)
def test_header_compiles_alone_as_c99(header: Path, tmp_path: Path) -> None:
    source = tmp_path / "alone.c"
    source.write_text(f'#include "{header.relative_to(tools.FIRMWARE)}"\nextern int something;\n')
    tools.assert_silent([tools.first_installed("cc|gcc|clang"), *C99, "-I", tools.FIRMWARE, source])


@pytest.mark.requires("c++|g++|clang++")
def test_facade_compiles_alone_as_cpp() -> None:
    compiler = tools.first_installed("c++|g++|clang++")
    flags = ("-std=c++11", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-fsyntax-only")
    tools.assert_silent([compiler, *flags, "-x", "c++", "-include", FACADE, "/dev/null"])


@pytest.mark.parametrize("folder", tools.CORE)
def test_folder_includes_only_what_it_may(folder: str) -> None:
    """port -> app -> {filter, can} -> {model, math}; the façade is for everybody."""
    for file in sorted((tools.FIRMWARE / folder).glob("*.[ch]")):
        includes = re.findall(r'^#include ([<"])([^>"]+)[>"]', file.read_text(encoding="utf-8"), re.MULTILINE)
        for bracket, name in includes:
            if bracket == "<":
                assert name in SYSTEM_HEADERS, f"{file}: <{name}>"
            elif name not in ("lever_cdkf.h", "lever_settings.def"):
                assert name.split("/")[0] in MAY_INCLUDE[folder], f"{file}: {name}"


@pytest.mark.parametrize("folder", sorted(path.name for path in (tools.FIRMWARE / "port").iterdir() if path.is_dir()))
def test_port_includes_only_what_it_may(folder: str) -> None:
    """Of the core the façade and the identifiers; only what runs on a desktop has headers of a system."""
    for file in sorted((tools.FIRMWARE / "port" / folder).glob("*.[ch]")):
        includes = re.findall(r'^#include ([<"])([^">]+)[">]', file.read_text(encoding="utf-8"), re.MULTILINE)
        for bracket, name in includes:
            if bracket == "<":
                assert folder in ("linux", "build") or name in SYSTEM_HEADERS, f"{file}: <{name}>"
            elif name not in (
                "lever_cdkf.h",
                "lever_settings.def",
                "lever_units.def",
                "lever_build.h",
                "lever_build_port.h",
            ):
                assert {name, str(Path(name).parent)} & PORT_MAY_INCLUDE[folder], f"{file}: {name}"


@pytest.mark.requirement("R15")
def test_no_double() -> None:
    for file in [*tools.core_sources(), *HEADERS, FACADE]:
        code = re.sub(r"/\*.*?\*/|//[^\n]*", "", file.read_text(encoding="utf-8"), flags=re.DOTALL)
        assert not re.search(r"\bdouble\b|\b\d+\.\d*(e[+-]?\d+)?(?![\dfFe])", code), f"{file}: a double"


def test_every_source_is_built() -> None:
    listed = (tools.FIRMWARE / "CMakeLists.txt").read_text(encoding="utf-8")
    missing = [source for source in tools.core_sources() if str(source.relative_to(tools.FIRMWARE)) not in listed]
    assert not missing, f"not in firmware/CMakeLists.txt: {missing}"


@pytest.mark.requires("nm")
def test_shared_library_exports_the_facade_and_nothing_else(build_dir: Path) -> None:
    assert symbols(build_dir / "firmware/liblever_cdkf.so", "--dynamic", "--defined-only") == functions_of_the_facade()


@pytest.mark.requires("nm")
@pytest.mark.requirement("R15")
def test_core_calls_nothing_but_a_few_library_functions(build_dir: Path) -> None:
    library = build_dir / "firmware/liblever_cdkf.a"
    called = symbols(library, "--undefined-only") - symbols(library, "--defined-only")
    assert {name for name in called if not name.startswith("_")} <= LIBRARY_FUNCTIONS


@pytest.mark.requires("readelf")
@pytest.mark.requirement("R15")
def test_core_has_no_mutable_statics(build_dir: Path) -> None:
    output = tools.run(["readelf", "--section-headers", "--wide", build_dir / "firmware/liblever_cdkf.a"]).stdout
    section = re.compile(r"\] (\.t?(?:data|bss)\S*)\s+\w+\s+[0-9a-f]+ [0-9a-f]+ ([0-9a-f]+)")
    sizes = section.findall(output)
    assert sizes
    assert not [(name, size) for name, size in sizes if int(size, 16) and not name.startswith(".data.rel.ro")]
