"""`lever fmu`: what it says, and what it writes."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import pytest
from lever_cdkf.fmu.binary import headers
from python.conftest import Refused, Run


def test_an_fmu_has_all_its_parts(fmus: Path) -> None:
    for name in ("lever", "pilot"):
        with zipfile.ZipFile(fmus / f"{name}.fmu") as archive:
            names = archive.namelist()
            page = archive.read("documentation/index.html").decode()
        assert {"modelDescription.xml", "sources/buildDescription.xml", "sources/fmi3.c"} <= set(names)
        assert any(each.startswith("binaries/") for each in names)
        assert "What it cannot do" in page
        assert "ℓ² k_p" in page
        assert "$" not in page
        assert not [each for each in names if each.endswith(("fmi3Functions.h", "fmi3FunctionTypes.h"))]


def test_the_same_twice_is_the_same(fmus: Path, lever: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """But for the time in it: the token stays. Of the sources; the compiler of the second has nothing to do."""
    compiler = tmp_path / "cc"
    compiler.write_text('#!/bin/sh\nwhile [ "$1" != -o ]; do shift; done\ntouch "$2"\n')
    compiler.chmod(0o755)
    monkeypatch.setenv("CC", str(compiler))
    assert lever("fmu", "controller", "-o", tmp_path / "again.fmu")[0] == 0
    contents = []
    for path in (fmus / "lever.fmu", tmp_path / "again.fmu"):
        with zipfile.ZipFile(path) as archive:
            contents.append({name: archive.read(name) for name in archive.namelist() if name.startswith("sources/")})
    assert contents[0] == contents[1]


def test_sources_compile_without_a_warning(controller: Path, pilot: Path) -> None:
    """Under the project's warnings, as errors."""
    warnings = (
        "all",
        "extra",
        "pedantic",
        "conversion",
        "double-promotion",
        "shadow",
        "missing-prototypes",
        "cast-qual",
    )
    options = ["-std=c99", "-fsyntax-only", "-Werror", *(f"-W{each}" for each in warnings), "-isystem", str(headers())]
    for folder in (controller / "sources", pilot / "sources"):
        sources = sorted(str(each) for each in folder.rglob("*.c"))
        result = subprocess.run(
            ["gcc", *options, "-I", str(folder), *sources], capture_output=True, text=True, check=False
        )
        assert (result.returncode, result.stderr) == (0, "")


def test_the_build_description_names_all_that_a_build_takes(controller: Path, tmp_path: Path) -> None:
    """With its sources and libraries alone no symbol is undefined."""
    folder = controller / "sources"
    root = ElementTree.parse(folder / "buildDescription.xml").getroot()
    (files,) = root.iter("SourceFileSet")
    sources = [str(folder / each.attrib["name"]) for each in files.iter("SourceFile")]
    libraries = [f"-l{each.attrib['name']}" for each in root.iter("Library")]
    options = [f"-std={files.attrib['language'].lower()}", *files.attrib["compilerOptions"].split()]
    options += ["-shared", "-fPIC", "-Wl,--no-undefined", "-isystem", str(headers()), "-I", str(folder)]
    command = ["gcc", *options, *sources, *libraries, "-o", str(tmp_path / "built.so")]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (result.returncode, result.stderr) == (0, "")


def test_what_is_wrong_is_one_line(refused: Refused, tmp_path: Path) -> None:
    out = tmp_path / "x.fmu"
    cases = {
        ("controller", "--settings", "none.settings"): "none.settings: cannot be read: No such file or directory",
        ("controller", "--set", "k_p=1"): "k_p = 1.0 is out of range",
        ("controller", "--model", "arm"): "model = 'arm' is not known; allowed: lever, ",
        ("controller", "--aircraft", "uh60"): "uh60",
        ("pilot", "--scenario", "stedy"): "stedy",
        ("pilot", "--seeds", "0"): "--seeds 0: must be 1 to 1000",
        ("pilot", "--set", "x=1"): "x",
        ("pilot", "--aircraft", "uh60"): "uh60",
    }
    for arguments, text in cases.items():
        assert text in refused("fmu", *arguments, "-o", out)
    assert "cannot write" in refused("fmu", "controller", "-o", tmp_path / "none/x.fmu")
    assert "it is a folder" in refused("fmu", "pilot", "-o", tmp_path)
    assert "the name of an FMU ends in .fmu" in refused("fmu", "controller", "-o", tmp_path / "README.md")
    assert not list(tmp_path.iterdir())


def test_without_a_compiler(refused: Refused, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    assert "an FMU needs a C compiler, and there is none: apt install gcc, or set CC" in refused("fmu", "controller")
    monkeypatch.setenv("CC", "tcc9")
    assert "CC = tcc9: there is no such compiler" in refused("fmu", "controller", "-o", tmp_path / "x.fmu")


@pytest.mark.parametrize("kind", ["controller", "pilot"])
def test_ctrl_c_leaves_what_was_there(kind: str, tmp_path: Path) -> None:
    """While the compiler runs, which Ctrl-C of a terminal reaches as well."""
    out, temporary, compiler = tmp_path / "x.fmu", tmp_path / "temporary", tmp_path / "cc"
    out.write_bytes(b"old")
    temporary.mkdir()
    compiler.write_text("#!/bin/sh\ntouch compiling\nexec sleep 600\n")
    compiler.chmod(0o755)
    command = [sys.executable, "-m", "lever_cdkf.cli.main", "fmu", kind, "-o", str(out)]
    environment = {**os.environ, "CC": str(compiler), "TMPDIR": str(temporary)}
    pipe = subprocess.PIPE
    process = subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True, env=environment, start_new_session=True)
    end = time.monotonic() + 120.0
    while not list(temporary.rglob("compiling")):
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < end
        time.sleep(0.01)
    os.killpg(process.pid, signal.SIGINT)
    assert process.communicate(timeout=120.0) == ("", "lever: interrupted\n")
    assert process.returncode == 130
    assert out.read_bytes() == b"old"
    assert sorted(each.name for each in tmp_path.iterdir()) == ["cc", "temporary", "x.fmu"]
    assert list(temporary.iterdir()) == []


def test_help_teaches(lever: Run) -> None:
    for arguments in (("fmu",), ("fmu", "controller"), ("fmu", "pilot")):
        status, out, _ = lever(*arguments, "--help")
        assert status == 0
        assert "examples:" in out
