"""The numbers in firmware/port/PORTING.md: written there by `budget-accept`, and held to by test_guide.py."""

from __future__ import annotations

import re
from pathlib import Path

from lever_cdkf.firmware.library import ffi
from lever_cdkf.runtime.files import write_text

from .image import ESTIMATORS, FIRMWARE
from .port_sizes import FUNCTIONS, TRANSPORTS, Size
from .recording import MODELS

GUIDE = FIRMWARE / "port/PORTING.md"
_SECTION = r"(<!-- {name}: [^\n]* -->\n)(.*?)(<!-- /{name} -->)"

Values = dict[str, float]
"""Golden values by their path."""


def section(name: str) -> str:
    """Return what stands in the guide between <!-- name: … --> and <!-- /name -->."""
    return _find(GUIDE.read_text(encoding="utf-8"), name)[2].strip() + "\n"


def update(sections: dict[str, str]) -> None:
    """Write sections into the guide."""
    text = GUIDE.read_text(encoding="utf-8")
    for name, content in sections.items():
        begin, end = _find(text, name).span(2)
        text = f"{text[:begin]}\n{content}\n{text[end:]}"
    write_text(GUIDE, text)


def _find(text: str, name: str) -> re.Match[str]:
    match = re.search(_SECTION.format(name=name), text, re.DOTALL)
    assert match is not None, f"{GUIDE}: no section {name}"
    return match


def instructions(values: Values) -> str:
    """Return the table of instructions a sample."""
    lines = ["| | mean | worst, running | worst, first 2 s | cycles, mean |", "|---|---|---|---|---|"]
    pairs = [(estimator, model) for estimator in ESTIMATORS for model in MODELS]
    cases = {f"`lever_update()`, {estimator}, `{model}`": f"{estimator}.{model}" for estimator, model in pairs}
    cases |= {
        f"`lever_update()` with aircraft and mitigation, {each}, `lever`": f"bounce.{each}.lever" for each in ESTIMATORS
    }
    cases |= {f"the whole turn for a sample, {each}, `lever`": f"tick.{each}.lever" for each in ESTIMATORS}
    lines += [_counts(what, case, values) for what, case in cases.items()]
    for estimator in ESTIMATORS:
        most = values[f"instructions_after_gap.{estimator}"]
        lines.append(f"| `lever_update()`, {estimator}, `lever`, first sample after a gap | | {most:,.0f} | | |")
    lines.append(f"| `lever_init()`, once | {values['init.instructions']:,.0f} | | | {values['init.cycles']:,.0f} |")
    return "\n".join(lines) + "\n"


def _counts(what: str, case: str, values: Values) -> str:
    numbers = [values[f"instructions.{case}.{each}"] for each in ("mean", "worst", "start_up_worst")]
    cells = (f"{number:,.0f}" for number in (*numbers, values[f"cycles.{case}.mean"]))
    return f"| {what} | {' | '.join(cells)} |"


def memory(values: Values) -> str:
    """Return the table of flash, RAM and stack."""
    room, used = values["memory_bytes"], values["instance_bytes"]
    rows = {
        "flash: code of the core, all of it": values["text_bytes"],
        "flash: its constants, of which the texts of the settings are most": values["rodata_bytes"],
        "flash: code and constants of the recorder, where it is used": values["recorder_bytes"],
        "RAM: variables of the core": values["data_bytes"] + values["bss_bytes"],
        f"RAM: `lever_memory_t`, for each instance ({used:g} of them used)": room,
        "flash or RAM: `lever_config_t`, which instances may share": ffi.sizeof("lever_config_t"),
    }
    stack = {name.removeprefix("stack."): bytes_ for name, bytes_ in values.items() if name.startswith("stack.")}
    for name in ("lever_on_frame", "lever_step", "lever_next_frame", "lever_update", "lever_estimate", "lever_init"):
        rows[f"stack: `{name}()`, with all it calls"] = stack[name]
    lines = ["| | bytes |", "|---|---|", *(f"| {what} | {bytes_:,.0f} |" for what, bytes_ in rows.items())]
    return "\n".join(lines) + "\n"


def port(sizes: dict[str, dict[str, Size]]) -> str:
    """Return the table of the callbacks, from of_port() of each transport."""
    lines = ["| | on bxCAN | as SLCAN over a USART |", "|---|---|---|"]
    for name in (*FUNCTIONS, "all"):
        cells = (f"{size.bytes:,} bytes, {size.lines} lines" for size in (sizes[each][name] for each in TRANSPORTS))
        what = "the whole port: interrupts, start-up, clocks, self tests" if name == "all" else f"`{name}`"
        lines.append(f"| {what} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def port_image(images: Path, transport: str) -> Path:
    """Return the image of a transport in the folder where they were built."""
    return images / f"lever_stm32f4_{transport}.elf"
