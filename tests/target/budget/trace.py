"""The image in the Unicorn engine: which instructions every measured call executes, one by one.

QEMU's clock gives their number; this gives their addresses, and is a second, independent count of the same thing.
"""

from __future__ import annotations

import re
import struct
import tempfile
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import unicorn
from lever_cdkf.host_tools.errors import LeverError
from numpy.typing import NDArray
from unicorn import arm_const

from .image import SAMPLES_ADDRESS, arguments, run_tool
from .recording import Recording

_FLASH, _FLASH_BYTES = 0x08000000, 1 << 20
_RAM, _RAM_BYTES = 0x20000000, 128 << 10
_SYSTEM, _SYSTEM_BYTES = 0xE000E000, 0x1000
_SYST_CVR = 0xE000E018
_BREAKPOINT = 7  # the engine's number of the exception that semihosting uses
_SYS_WRITE0, _SYS_WRITE, _SYS_GET_CMDLINE, _SYS_EXIT = 0x04, 0x05, 0x15, 0x18
_RECORDS = 1024  # that the image keeps before it writes them
_MEASURED_BEFORE = 3
"""The image measures nothing, a loop and lever_init() before the first sample."""

_INSTRUCTION = re.compile(r"^\s*([0-9a-f]+):\t(\S+)(?:\t([^@;\n]*))?", re.MULTILINE)
_SYMBOL = re.compile(r"^([0-9a-f]+) ([0-9a-f]+) [tT] (\S+)$", re.MULTILINE)
_CONDITION = "(?:eq|ne|cs|cc|hs|lo|mi|pl|vs|vc|hi|ls|ge|lt|gt|le)?"
_ONE_OPERATION = re.compile(rf"v(?:add|sub|mul|nmul|div|sqrt){_CONDITION}\.f32")
_TWO_OPERATIONS = re.compile(rf"v(?:mla|mls|nmla|nmls|fma|fms|fnma|fnms){_CONDITION}\.f32")


@dataclass(frozen=True)
class Instruction:
    """A line of the disassembly."""

    mnemonic: str
    operands: str

    @property
    def operations(self) -> int:
        """Floating-point operations: additions, multiplications, divisions, square roots; two in a multiply-accumulate.
        Comparisons, conversions, moves and changes of sign are none."""
        return 2 if _TWO_OPERATIONS.match(self.mnemonic) else int(bool(_ONE_OPERATION.match(self.mnemonic)))


def disassemble(elf: Path) -> dict[int, Instruction]:
    """Every instruction of the image by its address, in order."""
    text = run_tool("objdump", "-d", "--no-show-raw-insn", elf)
    lines = _INSTRUCTION.findall(text)
    return {int(address, 16): Instruction(mnemonic, operands.strip()) for address, mnemonic, operands in lines}


def functions(elf: Path) -> list[tuple[int, int, str]]:
    """Address, bytes and name of every function in the image; several may have one name."""
    found = _SYMBOL.findall(run_tool("nm", "-S", elf))
    return sorted((int(address, 16) & ~1, int(size, 16), name) for address, size, name in found)


def _flash(elf: Path) -> bytes:
    """The image as it is in flash."""
    with tempfile.NamedTemporaryFile(prefix="lever-budget-") as file:
        run_tool("objcopy", "-O", "binary", elf, file.name)
        return Path(file.name).read_bytes()


@dataclass(frozen=True)
class Trace:
    """What was executed in the measured calls of the samples that were asked for."""

    instructions: NDArray[np.int64]
    """Of each sample."""
    operations: NDArray[np.int64]
    """Floating-point operations of each sample; one under a condition that does not hold counts, as in a clock."""
    executed: list[Counter[int]]
    """Of each sample, how often the instruction at an address was."""


def trace(elf: Path, recording: Recording, model: str, estimator: str, form: str, first: int, last: int) -> Trace:
    """Runs the image over samples 0 to `last` and follows those from `first` on. Raises LeverError."""
    words = ["budget", "-", form, *arguments(recording, model, estimator), "paint=0"]
    machine = _Machine(elf, recording.blob(form), words)
    paths = machine.run(first, last)
    code = disassemble(elf)
    executed = [_instructions(code, path) for path in paths]
    operations = {address: instruction.operations for address, instruction in code.items()}
    return Trace(
        np.array([seen.total() for seen in executed]),
        np.array([sum(operations[address] * times for address, times in seen.items()) for seen in executed]),
        executed,
    )


def _instructions(code: dict[int, Instruction], path: Counter[tuple[int, int]]) -> Counter[int]:
    """The instructions in the blocks (address, bytes) of a path. All are there, as literals are in no block."""
    seen: Counter[int] = Counter()
    for (begin, size), times in path.items():
        for address in range(begin, begin + size, 2):
            if address in code:
                seen[address] += times
    return seen


class _Machine:
    """The processor with flash, RAM, a SysTick that stands still, and the semihosting that the image uses.

    The image reads SysTick before and after each measured call; what is executed in between is noted: instruction by
    instruction in main(), which does the reading, block by block elsewhere, which is faster.
    """

    def __init__(self, elf: Path, samples: bytes, words: list[str]) -> None:
        self._words = " ".join(words).encode() + b"\0"
        self._following = False
        self._measuring = False
        self._measured = -_MEASURED_BEFORE
        self._wanted = range(0)
        self._path: list[tuple[int, int]] = []
        self._paths: list[Counter[tuple[int, int]]] = []
        self._message = ""
        self._uc = uc = unicorn.Uc(unicorn.UC_ARCH_ARM, unicorn.UC_MODE_THUMB | unicorn.UC_MODE_MCLASS)
        uc.ctl_set_cpu_model(arm_const.UC_CPU_ARM_CORTEX_M4)
        for address, size in ((_FLASH, _FLASH_BYTES), (_RAM, _RAM_BYTES), (_SYSTEM, _SYSTEM_BYTES)):
            uc.mem_map(address, size)
        uc.mem_write(_FLASH, _flash(elf))
        uc.mem_write(SAMPLES_ADDRESS, samples)
        self._main, self._main_bytes = next(entry[:2] for entry in functions(elf) if entry[2] == "main")
        uc.hook_add(unicorn.UC_HOOK_MEM_READ, self._on_clock, begin=_SYST_CVR, end=_SYST_CVR + 3)
        uc.hook_add(unicorn.UC_HOOK_INTR, self._on_exception)

    def run(self, first: int, last: int) -> list[Counter[tuple[int, int]]]:
        """The path through each of these samples: how often each block (address, bytes) was executed."""
        self._wanted = range(first, last + 1)
        stack, start = struct.unpack("<II", self._uc.mem_read(_FLASH, 8))
        self._uc.reg_write(arm_const.UC_ARM_REG_SP, stack)
        try:
            self._uc.emu_start(start | 1, 0)
            self._follow()
            self._uc.emu_start(self._uc.reg_read(arm_const.UC_ARM_REG_PC) | 1, 0)
        except unicorn.UcError as error:
            where = self._uc.reg_read(arm_const.UC_ARM_REG_PC)
            raise LeverError(f"the image in Unicorn: {error} at {where:#x}") from None
        if len(self._paths) < len(self._wanted):
            raise LeverError(f"the image in Unicorn ended early: {self._message}")
        return self._paths

    def _follow(self) -> None:
        """From here on what is executed is noted; before, that would only take time."""
        begin, end = self._main, self._main + self._main_bytes
        self._uc.hook_add(unicorn.UC_HOOK_CODE, self._on_code, begin=begin, end=end - 1)
        self._uc.hook_add(unicorn.UC_HOOK_BLOCK, self._on_code, begin=_FLASH, end=begin - 1)
        self._uc.hook_add(unicorn.UC_HOOK_BLOCK, self._on_code, begin=end, end=_FLASH + _FLASH_BYTES)
        self._uc.ctl_flush_tb()
        self._following = True

    def _on_code(self, _uc: Any, address: int, size: int, _data: Any) -> None:
        self._path.append((address, size))

    def _on_clock(self, uc: Any, _access: int, _address: int, _size: int, _value: int, _data: Any) -> None:
        """Comes after _on_code for the instruction that reads."""
        if self._measuring:
            if self._measured in self._wanted:
                self._paths.append(Counter(self._path[:-1]))
            self._measured += 1
            if self._measured == self._wanted.stop:
                uc.emu_stop()
        self._measuring = not self._measuring
        self._path.clear()

    def _on_exception(self, uc: Any, number: int, _data: Any) -> None:
        operation = uc.reg_read(arm_const.UC_ARM_REG_R0)
        argument = uc.reg_read(arm_const.UC_ARM_REG_R1)
        if number != _BREAKPOINT or operation == _SYS_EXIT:
            uc.emu_stop()
            return
        if operation == _SYS_WRITE0:
            self._message += bytes(uc.mem_read(argument, 80)).split(b"\0")[0].decode()
        if operation == _SYS_GET_CMDLINE:
            (text,) = struct.unpack("<I", uc.mem_read(argument, 4))
            uc.mem_write(text, self._words)
        uc.reg_write(arm_const.UC_ARM_REG_R0, 0)  # done; what is written goes nowhere
        uc.reg_write(arm_const.UC_ARM_REG_PC, (uc.reg_read(arm_const.UC_ARM_REG_PC) + 2) | 1)
        if operation == _SYS_WRITE and not self._following and self._measured + _RECORDS > self._wanted.start:
            uc.emu_stop()  # between two samples, and for the last time before the first that is wanted
