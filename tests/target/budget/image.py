"""Builds the image, runs it in QEMU over a recording, and reads what it measured.

`-icount shift=3` makes every instruction take 8 ns of the emulated clock, so SysTick at 168 MHz counts 1.344 ticks an
instruction, whatever the host does meanwhile. The image times a loop of known length first, and a run whose loop comes
out otherwise is refused.
"""

from __future__ import annotations

import fcntl
import shlex
import struct
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from lever_cdkf.errors import LeverError
from lever_cdkf.firmware.library import enum_names
from lever_cdkf.firmware.native import Config
from numpy.typing import NDArray

from .recording import MODELS, Recording

SOURCE = Path(__file__).with_name("image")
FIRMWARE = SOURCE.parents[3] / "firmware"
SHIPPED = "-O3 -DNDEBUG"
"""What CMake gives a Release build."""
MACHINE = "netduinoplus2"
SAMPLES_ADDRESS = 0x08040000
TICKS_AN_INSTRUCTION = 8e-9 * 168e6
ESTIMATORS = ("dual", "joint")
FORMS = ("update", "tick", "bounce")
"""What is measured: lever_update() alone; all that a sample takes from its frames to the last one of the answer;
lever_update() of an instance that knows the aircraft, and cancels and damps."""
CALLED_ONCE = ("lever_init", "lever_command", "lever_platform", "lever_estimate", "lever_health")

_TOOLCHAIN_PACKAGES = "gcc-arm-none-eabi libnewlib-arm-none-eabi"
_TIME_LIMIT_S = 1800.0
_INTRO = struct.Struct("<10I")
_RECORD = np.dtype([("ticks", "<u4"), ("faults", "<u4"), ("stack", "<u2"), ("mode", "u1"), ("frames", "u1")])


@dataclass(frozen=True)
class Run:
    """What the image measured: arrays have one value a sample."""

    instructions: NDArray[np.int64]
    """Of the measured calls, without those of the measurement."""
    overhead: int
    """Instructions of a measurement with nothing in between, which have been subtracted."""
    loop_instructions: int
    """Of a loop that was measured to calibrate the clock, and what came out."""
    loop_measured: float
    stack: NDArray[np.int64]
    """Bytes that the measured calls wrote below the caller's stack."""
    calls_stack: dict[str, int]
    """The same of the functions CALLED_ONCE."""
    mode: NDArray[np.int64]
    """A key of enum_names("lever_mode")."""
    faults: NDArray[np.int64]
    frames: NDArray[np.int64]
    """Frames sent."""
    init: int
    """Instructions of lever_init()."""
    said: bytes
    """lever_estimate_t, lever_stability_t and lever_correction_t after the last sample, one behind the other."""


def run_command(command: list[str], what: str, hint: str = "") -> str:
    """Return the output of a finished command. Raise LeverError with the last lines of a failed one."""
    try:
        result = subprocess.run(
            command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False, timeout=_TIME_LIMIT_S
        )
    except FileNotFoundError:
        raise LeverError(f"{command[0]} is not installed: apt install {hint or command[0]}") from None
    except subprocess.TimeoutExpired:
        raise LeverError(f"{what} did not end within {_TIME_LIMIT_S:g} s") from None
    if result.returncode != 0:
        tail = "\n".join(result.stdout.splitlines()[-25:])
        raise LeverError(f"{what} failed: {shlex.join(command)[:200]}\n{tail}")
    return result.stdout


def tool(name: str) -> str:
    """Return a program of the cross toolchain."""
    return f"arm-none-eabi-{name}"


def run_tool(name: str, *arguments: str | Path) -> str:
    """Return the output of a program of the cross toolchain. Raise LeverError."""
    return run_command([tool(name), *(str(argument) for argument in arguments)], name, _TOOLCHAIN_PACKAGES)


def call_graph(elf: Path) -> Path:
    """Return what the compiler says of the functions of the core as they are linked into the image."""
    return elf.with_name(f"{elf.name}.ltrans0.ltrans.ci")


def core_objects(elf: Path) -> dict[str, Path]:
    """Return the object files of the core, by source file ("filter/cdkf.c")."""
    folder = elf.parent / "lever_cdkf/CMakeFiles/lever_cdkf.dir"
    paths = sorted(folder.glob("*/*.c.obj"))
    return {str(path.relative_to(folder)).removesuffix(".obj"): path for path in paths}


def compiler() -> str:
    """Return name and version of the cross compiler. Raise LeverError when there is none."""
    return run_tool("gcc", "--version").splitlines()[0]


def build(folder: Path, firmware: Path = FIRMWARE, flags: str = SHIPPED, processor: str | None = None) -> Path:
    """Build the image of a firmware folder in `folder`, and return its .elf. `flags` are those of the optimiser,
    `processor` those that choose another processor than the M4F. Raise LeverError."""
    compiler()
    if not (firmware / "lever_cdkf.h").is_file():
        raise LeverError(f"{firmware}: no lever_cdkf.h there: give the firmware folder of a source tree")
    toolchain = f"--toolchain={FIRMWARE / 'port/stm32f4/toolchain.cmake'}"
    settings = ["-DCMAKE_BUILD_TYPE=Release", f"-DLEVER_FIRMWARE={firmware.resolve()}"]
    settings += [f"-DCMAKE_C_FLAGS_RELEASE={flags}", *([] if processor is None else [f"-DCMAKE_C_FLAGS={processor}"])]
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / "lock").open("w") as lock:  # tests that run side by side build it too
        fcntl.flock(lock, fcntl.LOCK_EX)
        configure = ["cmake", "-S", str(SOURCE), "-B", str(folder), toolchain, *settings]
        try:
            run_command(configure, "configuring the image")
        except LeverError:  # as after a change of the toolchain file, which CMake refuses to take over
            run_command([*configure, "--fresh"], "configuring the image")
        run_command(["cmake", "--build", str(folder), "--parallel", "2"], "building the image")
    return folder / "budget.elf"


def cases() -> list[tuple[str, str, str]]:
    """Estimator, model and form of all that is measured."""
    return [
        (estimator, model, form)
        for form in FORMS
        for estimator in ESTIMATORS
        for model in MODELS
        if form != "bounce" or model == "lever"
    ]


def mitigation(form: str) -> str:
    """Return what a form measures."""
    return "cancellation_and_damping" if form == "bounce" else "none"


def arguments(recording: Recording, model: str, estimator: str, form: str) -> list[str]:
    """Return the configuration as main.c reads it: what differs from the defaults."""
    config, default = recording.scenario.config, Config()
    numbers = {name: value for name, value in config.settings.items() if value != default.settings[name]}
    numbers["dither_rms"] = recording.dither_rms
    choices = {**config.choices, "model": model, "estimator": estimator, "mitigation": mitigation(form)}
    codes = {what: list(enum_names(f"lever_{what}").values()).index(name) for what, name in choices.items()}
    words = [f"{what}={code:x}" for what, code in codes.items()]
    return words + [f"{name}={struct.unpack('<I', struct.pack('<f', value))[0]:x}" for name, value in numbers.items()]


def run(elf: Path, recording: Recording, model: str, estimator: str, form: str) -> Run:
    """Run the image over the recording in one of FORMS. Raise LeverError."""
    with tempfile.TemporaryDirectory(prefix="lever-budget-") as name:
        samples, output = Path(name) / "samples", Path(name) / "output"
        samples.write_bytes(recording.blob(form))
        words = ["budget", str(output), form, *arguments(recording, model, estimator, form)]
        semihosting = "enable=on,target=native," + ",".join(f"arg={word}" for word in words)
        command = ["qemu-system-arm", "-M", MACHINE, "-nographic", "-monitor", "none", "-serial", "none"]
        command += ["-icount", "shift=3,sleep=off", "-semihosting-config", semihosting, "-kernel", str(elf)]
        command += ["-device", f"loader,file={samples},addr={SAMPLES_ADDRESS:#x},force-raw=on"]
        run_command(command, f"the image in QEMU ({estimator}, {model}, {form})", "qemu-system-arm")
        return _read(output.read_bytes(), len(recording.samples))


def _read(data: bytes, count: int) -> Run:
    """Return what the image wrote. Raise LeverError when its own loop was not timed right, or something is missing."""
    empty, calibration, rounds, *stacks, init, said_bytes = _INTRO.unpack_from(data)
    looped = (calibration - empty) / TICKS_AN_INSTRUCTION
    if abs(looped - 2 * rounds) > 1.0:
        raise LeverError(f"QEMU's clock is off: a loop of {2 * rounds} instructions was timed as {looped:.1f}")
    end = _INTRO.size + count * _RECORD.itemsize
    if len(data) != end + said_bytes:
        raise LeverError(f"the image wrote {len(data)} bytes of results for {count} samples: it is not of this version")
    records = np.frombuffer(data[_INTRO.size : end], _RECORD)
    instructions = np.rint((records["ticks"].astype(np.int64) - empty) / TICKS_AN_INSTRUCTION)
    whole = {name: records[name].astype(np.int64) for name in ("stack", "mode", "faults", "frames")}
    once = dict(zip(CALLED_ONCE, stacks, strict=True))
    return Run(
        instructions.astype(np.int64),
        overhead=round(empty / TICKS_AN_INSTRUCTION),
        loop_instructions=2 * rounds,
        loop_measured=looped,
        calls_stack=once,
        init=round((init - empty) / TICKS_AN_INSTRUCTION),
        said=data[end:],
        **whole,
    )
