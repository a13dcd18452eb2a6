"""The core as an installed CMake package or a sub-directory: another project computes the same bits with it."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import Built
from lever_cdkf.firmware.native import run_samples
from quality import tools

BY = "build.package"
"""The entry of ctest that has run package/build.cmake."""


def test_what_is_installed(built: Built) -> None:
    """The library, its manual, the contract, and what find_package reads; nothing of Python's or of the inside."""
    prefix = built("package/installed", BY)
    files = {str(file.relative_to(prefix)) for file in prefix.rglob("*") if file.is_file()}
    library = next(prefix.rglob("liblever_cdkf.a")).relative_to(prefix)
    package = f"{library.parent}/cmake/lever_cdkf/lever_cdkfConfig"
    described = {f"{package}.cmake", f"{package}-release.cmake", f"{package}Version.cmake"}
    headers = {"include/lever_cdkf.h", "include/lever_settings.def"}
    assert files == {str(library), "share/lever_cdkf/lever.dbc", *headers, *described}
    for name in ("lever_cdkf.h", "lever_settings.def"):
        assert (prefix / "include" / name).read_bytes() == (tools.FIRMWARE / name).read_bytes()


@pytest.mark.parametrize("folder", ["with_installed", "with_sources"])
def test_another_project_computes_the_same(folder: str, built: Built) -> None:
    printed = tools.run([built(f"package/{folder}/package", BY)]).stdout.split()
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
def test_the_package_of_a_microcontroller(built: Built) -> None:
    """Cross-compiled, installed, found by a cross-compiled project: all of it is code of a Cortex-M4F with its FPU."""
    program = built("package/stm32f4/package", BY)
    attributes = tools.run(["arm-none-eabi-readelf", "--arch-specific", program]).stdout
    for expected in ("Tag_CPU_arch: v7E-M", "Tag_FP_arch: VFPv4-D16", "Tag_ABI_VFP_args: VFP registers"):
        assert expected in attributes
