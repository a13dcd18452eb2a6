"""The linters find what they are there to find, and look at every file that they should."""

from __future__ import annotations

import json
from pathlib import Path

from lint import checks


def test_a_file_in_another_layout_is_found(tmp_path: Path) -> None:
    seeded = tmp_path / "seeded.c"
    seeded.write_text("int  seeded( void ) {return 1;}\n")
    assert "clang-format-violations" in checks.layout(seeded)


def test_clang_tidy_finds_a_seeded_violation(tmp_path: Path) -> None:
    seeded = tmp_path / "seeded.c"
    declared = "#include <stdlib.h>\nint seeded(const char *text);\n"
    seeded.write_text(declared + "int seeded(const char *text)\n{\n    return atoi(text);\n}\n")
    entry = {"directory": str(tmp_path), "file": str(seeded), "arguments": ["cc", "-std=c99", "-c", str(seeded)]}
    (tmp_path / "compile_commands.json").write_text(json.dumps([entry]))
    assert "cert-err34-c" in checks.tidy(tmp_path, seeded)


def test_seeded_violations_of_misra_are_found(tmp_path: Path) -> None:
    seeded = tmp_path / "seeded.c"
    seeded.write_text(
        "#include <stdint.h>\n"
        "extern uint32_t seeded(uint32_t x);\n"
        "uint32_t seeded(uint32_t x)\n"
        "{\n"
        "    uint32_t y = 010;\n"
        "    if (x > 1u)\n"
        "        y = seeded(x - 1u);\n"
        "    return y;\n"
        "}\n"
    )
    findings = checks.misra(seeded)
    assert all(f"misra-c2012-{rule}\n" in findings for rule in ("7.1", "15.6", "17.2"))


def test_seeded_violations_in_an_interrupt_are_found(tmp_path: Path) -> None:
    """The driver of CAN, as it is compiled for its image, with a few lines more."""
    text = (checks.FIRMWARE / "port/stm32f4/can.c").read_text(encoding="utf-8")
    seeded = tmp_path / "can.c"
    begin = "void can_error_interrupt(void)\n{\n"
    assert begin in text
    wrong = "    uint32_t *address = (uint32_t *)0x40006400;\n    if (*address)\n        off = *address;\n"
    seeded.write_text(text.replace(begin, begin + wrong))
    findings = checks.misra_image(str(tmp_path), seeded)
    assert all(f"misra-c2012-{rule}\n" in findings for rule in ("11.4", "14.4", "15.6"))
    assert "can.c:" not in checks.misra_image(str(tmp_path), checks.FIRMWARE / "port/stm32f4/can.c")


def test_seeded_violations_in_the_port_to_posix_are_found(tmp_path: Path) -> None:
    text = (checks.FIRMWARE / "port/linux/clock.c").read_text(encoding="utf-8")
    seeded = tmp_path / "clock.c"
    wrong = "\nint seeded(int x)\n{\n    if (x)\n        x = 010;\n    return x;\n}\n"
    seeded.write_text(text.replace('"port/', f'"{checks.FIRMWARE}/port/') + wrong)
    findings = checks.misra_posix(seeded)
    assert all(f"misra-c2012-{rule}\n" in findings for rule in ("7.1", "14.4", "15.6"))


def test_seeded_errors_are_found_by_cppcheck_and_by_the_analyzer(tmp_path: Path) -> None:
    seeded = tmp_path / "seeded.c"
    seeded.write_text(
        "#include <stdlib.h>\n"
        "int seeded(int x);\n"
        "int seeded(int x)\n"
        "{\n"
        "    int *memory = malloc(sizeof *memory);\n"
        "    int result = *memory;\n"
        "    free(memory);\n"
        "    return (x > 0) ? result : *memory;\n"
        "}\n"
    )
    assert "Werror=analyzer-use-after-free" in checks.analyzer(str(tmp_path), seeded)
    assert "error deallocret" in checks.misra(seeded)


def test_every_deviation_from_misra_is_documented_and_used() -> None:
    files = (file for suffix in "ch" for file in checks.FIRMWARE.rglob(f"*.{suffix}"))
    assert checks.suppressed(file.read_text(encoding="utf-8") for file in files) == (checks.DEVIATIONS, 0)


def test_every_folder_of_python_files_is_looked_at() -> None:
    top = {path.relative_to(checks.ROOT).parts[0] for path in checks.ROOT.glob("[!.]*/**/*.py")}
    assert top - {"build"} <= set(checks.PYTHON_FOLDERS)
