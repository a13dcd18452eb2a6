"""The core as an installed CMake package or a sub-directory: another project computes the same bits with it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from lever_cdkf.host_tools.firmware.native import run_samples
from quality import tools

PROJECT = Path(__file__).with_name("package")
TOOLCHAIN = tools.FIRMWARE / "port/stm32f4/toolchain.cmake"


def install(build: Path, prefix: Path) -> Path:
    """Installs the core out of a finished build."""
    tools.assert_silent(["cmake", "--install", build, "--component", "core", "--prefix", prefix])
    return prefix


def build(folder: Path, *settings: str | Path) -> Path:
    """The program of the other project; without optimisation, as the bits are the same."""
    tools.assert_silent(["cmake", "-S", PROJECT, "-B", folder, "-DCMAKE_BUILD_TYPE=Debug", *settings])
    tools.assert_silent(["cmake", "--build", folder])
    return folder / "package"


@pytest.fixture(scope="module")
def prefix(build_dir: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return install(build_dir, tmp_path_factory.mktemp("installed"))


def test_what_is_installed(prefix: Path) -> None:
    """The library, its manual, the contract, and what find_package reads; nothing of Python's or of the inside."""
    files = {str(file.relative_to(prefix)) for file in prefix.rglob("*") if file.is_file()}
    library = next(prefix.rglob("liblever_cdkf.a")).relative_to(prefix)
    package = f"{library.parent}/cmake/lever_cdkf/lever_cdkfConfig"
    described = {f"{package}.cmake", f"{package}-release.cmake", f"{package}Version.cmake"}
    headers = {"include/lever_cdkf.h", "include/lever_settings.def"}
    assert files == {str(library), "share/lever_cdkf/lever.dbc", *headers, *described}
    for name in ("lever_cdkf.h", "lever_settings.def"):
        assert (prefix / "include" / name).read_bytes() == (tools.FIRMWARE / name).read_bytes()


@pytest.mark.parametrize("installed", [True, False])
def test_another_project_computes_the_same(installed: bool, prefix: Path, tmp_path: Path) -> None:
    printed = tools.run([build(tmp_path, *([f"-Dlever_cdkf_ROOT={prefix}"] if installed else []))]).stdout.split()

    phase = np.arange(1000) % 333 - 166
    swing = (phase * (166 - abs(phase))).astype(np.float32) / np.float32(6889.0)
    theta = np.float32(0.35) + np.float32(0.0625) * swing
    still = np.zeros(1000)
    samples = {"time_us": np.arange(1000) * 1000, "theta": theta, "tau_m": still, "z_ddot": still}
    estimate = run_samples(None, samples, np.array([999]))
    expected = [estimate[name].view(np.uint32)[0] for name in ("theta", "natural_frequency")]
    assert printed == [f"{bits:08x}" for bits in expected]
    assert abs(float(estimate["theta"][0]) - float(theta[-1])) < 0.01


@pytest.mark.requires("arm-none-eabi-gcc")
def test_the_package_of_a_microcontroller(can_image: Path, tmp_path: Path) -> None:
    """Cross-compiled, installed, found by a cross-compiled project: all of it is code of a Cortex-M4F with its FPU."""
    prefix = install(can_image.parent, tmp_path / "prefix")
    flags = "-DCMAKE_EXE_LINKER_FLAGS=--specs=nosys.specs"
    cross = (f"-DCMAKE_TOOLCHAIN_FILE={TOOLCHAIN}", f"-DCMAKE_FIND_ROOT_PATH={prefix}", flags)
    program = build(tmp_path / "project", f"-Dlever_cdkf_ROOT={prefix}", *cross)
    attributes = tools.run(["arm-none-eabi-readelf", "--arch-specific", program]).stdout
    for expected in ("Tag_CPU_arch: v7E-M", "Tag_FP_arch: VFPv4-D16", "Tag_ABI_VFP_args: VFP registers"):
        assert expected in attributes
