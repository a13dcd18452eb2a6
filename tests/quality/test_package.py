"""The core as an installed CMake package or a sub-directory: another project computes the same bits with it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import readmes
from conftest import Built
from lever_cdkf.firmware.native import run_samples
from quality import tools

BY = "build.package"
"""The entry of ctest that has run package/build.cmake."""


def test_what_is_installed(built: Built) -> None:
    """Core and port, their headers, the contract, and what find_package and pkg-config read; nothing of Python's or of
    the inside."""
    prefix = built("package/installed", BY)
    files = {str(file.relative_to(prefix)) for file in prefix.rglob("*") if file.is_file()}
    folder = next(prefix.rglob("liblever_cdkf.a")).relative_to(prefix).parent
    package = f"{folder}/cmake/lever_cdkf/lever_cdkfConfig"
    described = {f"{package}.cmake", f"{package}-release.cmake", f"{package}Version.cmake"}
    described |= {f"{folder}/pkgconfig/{name}.pc" for name in ("lever_cdkf", "lever_cdkf_port")}
    libraries = {f"{folder}/lib{name}.a" for name in ("lever_cdkf", "lever_port")}
    headers = {f"include/{name}": name for name in ("lever_cdkf.h", "lever_settings.def")}
    of_port = ("command_guard", "identifiers", "loop", "port", "recording", "slcan/slcan")
    embedded = (f"embedded/{name}" for name in ("crc32", "ram_test", "ring", "rom_test", "self_test"))
    for name in ("can/messages.h", *(f"port/{name}.h" for name in (*of_port, *embedded))):
        headers[f"include/lever_cdkf/{name}"] = name
    assert files == {"share/lever_cdkf/lever.dbc", *libraries, *headers, *described}
    for installed, name in headers.items():
        assert (prefix / installed).read_bytes() == (tools.FIRMWARE / name).read_bytes()


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


@pytest.mark.parametrize("folder", ["with_installed", "with_sources"])
def test_another_project_makes_a_port(folder: str, built: Built) -> None:
    """With the loop, guard, self test and CRC of the target lever_cdkf::port."""
    passed, received, crc = tools.run([built(f"package/{folder}/port", BY)]).stdout.split()
    assert (passed, received) == ("passed", "1")
    assert int(crc, 16) != 0


FLIGHT = """
#include <stdio.h>
int main(void)
{
    lever_estimate_t now;
    uint32_t noise = 1u;
    unsigned good = 0u;
    float theta = 0.02f, rate = 0.0f, base = 0.0f;
    for (uint32_t k = 0u; k < 5000u; k++) { /* an arm of 3 Hz on a base that is shaken */
        noise = (1664525u * noise) + 1013904223u;
        base += 0.05f * (((float)(noise >> 16) * 3.0e-4f) - 9.8f - base);
        rate += 0.001f * ((-355.0f * theta) - (10.0f * rate) - (2.0f * base));
        theta += 0.001f * rate;
        good += estimate(1000u * k, 0.35f + theta, rate, 0.0f, base, &now) ? 1u : 0u;
    }
    printf("%u %.2f\\n", good, (double)now.natural_frequency);
    return 0;
}
"""


@pytest.mark.requires("cc")
def test_the_function_of_the_readme_estimates(built: Built, tmp_path: Path) -> None:
    """The block of C in firmware/README.md, called as it says; its result tells when the estimate may be used."""
    prefix = built("package/installed", BY)
    (example,) = readmes.blocks(tools.FIRMWARE / "README.md", "c").values()
    (tmp_path / "main.c").write_text(example + FLIGHT, encoding="utf-8")
    library = next(prefix.rglob("liblever_cdkf.a"))
    flags = ["-std=c99", "-Wall", "-Wextra", "-Werror", f"-I{prefix / 'include'}"]
    tools.assert_silent(["cc", *flags, tmp_path / "main.c", library, "-lm", "-o", tmp_path / "flight"])
    good, frequency = map(float, tools.run([tmp_path / "flight"]).stdout.split())
    assert 3000 < good < 5000
    assert frequency == pytest.approx(3.0, rel=0.1)


@pytest.mark.requires("pkg-config", "cc")
@pytest.mark.parametrize(
    ("package", "source", "program"), [("lever_cdkf", "main.c", "package"), ("lever_cdkf_port", "port.c", "port")]
)
def test_pkg_config_finds_it(
    package: str, source: str, program: str, built: Built, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    prefix = built("package/installed", BY)
    (found,) = prefix.rglob(f"{package}.pc")
    monkeypatch.setenv("PKG_CONFIG_PATH", str(found.parent))
    flags = tools.run(["pkg-config", "--cflags", "--libs", package]).stdout.split()
    tools.assert_silent(
        ["cc", "-std=c99", Path(__file__).parent / "package" / source, *flags, "-o", tmp_path / program]
    )
    assert tools.run([tmp_path / program]).stdout == tools.run([built(f"package/with_installed/{program}", BY)]).stdout


@pytest.mark.requires("arm-none-eabi-gcc")
def test_the_package_of_a_microcontroller(built: Built) -> None:
    """Cross-compiled, installed, found by a cross-compiled project: all of it is code of a Cortex-M4F with its FPU."""
    program = built("package/stm32f4/package", BY)
    attributes = tools.run(["arm-none-eabi-readelf", "--arch-specific", program]).stdout
    for expected in ("Tag_CPU_arch: v7E-M", "Tag_FP_arch: VFPv4-D16", "Tag_ABI_VFP_args: VFP registers"):
        assert expected in attributes
