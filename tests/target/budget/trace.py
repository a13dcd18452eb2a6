"""The image in the Unicorn engine: which instructions every measured call executes.

QEMU's clock gives their number; this gives their addresses, is a second, independent count of the same thing, and is
what cycles are computed from.
"""

from __future__ import annotations

import ctypes
import re
import struct
import tempfile
from collections import Counter
from collections.abc import Iterable
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import unicorn
from lever_cdkf.errors import LeverError
from numpy.typing import NDArray
from unicorn import arm_const
from unicorn.unicorn_py3 import unicorn as engine

from . import cycles
from .cycles import Instruction
from .image import SAMPLES_ADDRESS, arguments, run_command, run_tool
from .recording import Recording

_FLASH, _FLASH_BYTES = 0x08000000, 1 << 20
_RAM, _RAM_BYTES = 0x20000000, 128 << 10
_HOOK = Path(__file__).with_name("path.c")
_ROOM = 1 << 20  # PATH_ROOM
_SYSTEM, _SYSTEM_BYTES = 0xE000E000, 0x1000
_SYST_CVR = 0xE000E018
_BREAKPOINT = 7  # the engine's number of the exception that semihosting uses
_SYS_WRITE0, _SYS_GET_CMDLINE, _SYS_EXIT = 0x04, 0x15, 0x18

EMPTY, LOOP, INIT = -3, -2, -1
"""What the image measures before the first sample: nothing, a loop, lever_init()."""

_INSTRUCTION = re.compile(r"^\s*([0-9a-f]+):\t(\S+)(?:\t([^@;\n]*))?", re.MULTILINE)
_SYMBOL = re.compile(r"^([0-9a-f]+) ([0-9a-f]+) [tT] (\S+)$", re.MULTILINE)


def disassemble(elf: Path) -> dict[int, Instruction]:
    """Return every instruction of the image by its address, in order."""
    text = run_tool("objdump", "-d", "--no-show-raw-insn", elf)
    lines = _INSTRUCTION.findall(text)
    return {int(address, 16): Instruction(mnemonic, operands.strip()) for address, mnemonic, operands in lines}


def functions(elf: Path) -> list[tuple[int, int, str]]:
    """Address, bytes and name of every function in the image; several may have one name."""
    found = _SYMBOL.findall(run_tool("nm", "-S", elf))
    return sorted((int(address, 16) & ~1, int(size, 16), name) for address, size, name in found)


def _flash(elf: Path) -> bytes:
    """Return the image as it is in flash."""
    with tempfile.NamedTemporaryFile(prefix="lever-budget-") as file:
        run_tool("objcopy", "-O", "binary", elf, file.name)
        return Path(file.name).read_bytes()


class _Code:
    """The instructions of an image. A block of straight code is one number: its address, and 2^32 times its bytes."""

    def __init__(self, elf: Path) -> None:
        self._code = disassemble(elf)
        self._costs: dict[tuple[int, int], tuple[int, int, int]] = {}

    def block(self, block: int) -> dict[int, Instruction]:
        """Return those of a block, by address. All are there, as literals are in no block."""
        begin, size = block & 0xFFFFFFFF, block >> 32
        return {address: self._code[address] for address in range(begin, begin + size, 2) if address in self._code}

    def spent(self, block: int, after: int) -> dict[int, int]:
        """Cycles by address in a block that is followed by the block `after`."""
        code, following = self.block(block), after & 0xFFFFFFFF
        is_jump = (block & 0xFFFFFFFF) + (block >> 32) != following
        return dict(zip(code, cycles.of_block([*code.values()], self._code[following], is_jump), strict=True))

    def cost(self, block: int, after: int) -> tuple[int, int, int]:
        """Instructions, floating-point operations and cycles of a block that is followed by the block `after`."""
        if (block, after) not in self._costs:
            operations = sum(each.operations for each in self.block(block).values())
            spent = self.spent(block, after)
            self._costs[block, after] = (len(spent), operations, sum(spent.values()))
        return self._costs[block, after]


@cache
def _code(elf: Path) -> _Code:
    """Return the code of an image that does not change while this runs."""
    return _Code(elf)


def _steps(path: NDArray[np.uint64]) -> Counter[tuple[int, int]]:
    """Return how often which block was followed by which."""
    return Counter(pairwise(path.tolist()))


class Trace:
    """What was executed in the measured calls of the samples that were asked for."""

    def __init__(self, code: _Code, paths: list[NDArray[np.uint64]]) -> None:
        """Of the blocks that were executed in each sample; the last one is not measured."""
        self._code, self._paths = code, paths
        costs = self._costs()
        self.instructions: NDArray[np.int64] = costs[:, 0]
        """Of each sample."""
        self.operations: NDArray[np.int64] = costs[:, 1]
        """Floating-point operations of each sample; one under a condition that does not hold counts, as in a clock."""
        self.cycles: NDArray[np.int64] = costs[:, 2]
        """Of each sample, by the model of cycles.py."""

    def _costs(self) -> NDArray[np.int64]:
        """Return a row of _Code.cost() for each sample, whose last block is not measured."""
        blocks, kinds = np.unique(np.concatenate(self._paths), return_inverse=True)
        ends = np.cumsum([len(path) for path in self._paths])
        steps = kinds * len(blocks) + np.roll(kinds, -1)
        steps[ends - 1] = len(blocks) ** 2  # none
        table = np.zeros((len(blocks) ** 2 + 1, 3), np.int64)
        for step in np.flatnonzero(np.bincount(steps)[: len(blocks) ** 2]).tolist():
            block, after = divmod(step, len(blocks))
            table[step] = self._code.cost(int(blocks[block]), int(blocks[after]))
        total: NDArray[np.int64] = np.add.reduceat(table[steps], np.concatenate(([0], ends[:-1])))
        return total

    def executed(self, samples: Iterable[int]) -> tuple[Counter[int], Counter[int]]:
        """Return how often the instruction at an address was executed in these samples, and its cycles."""
        times: Counter[int] = Counter()
        spent: Counter[int] = Counter()
        for sample in samples:
            for step, count in _steps(self._paths[sample]).items():
                for address, each in self._code.spent(*step).items():
                    times[address] += count
                    spent[address] += count * each
        return times, spent


def trace(elf: Path, recording: Recording, model: str, estimator: str, form: str, first: int, last: int) -> Trace:
    """Run the image over samples 0 to `last` and follow those from `first` on, or what is measured before (LOOP,
    INIT). Raise LeverError."""
    words = ["budget", "-", form, *arguments(recording, model, estimator, form), "paint=0"]
    return Trace(_code(elf), _Machine(elf, recording.blob(form), words).run(first, last))


@cache
def _hook() -> ctypes.CDLL:
    """path.c, compiled. Raises LeverError."""
    with tempfile.TemporaryDirectory(prefix="lever-budget-") as folder:
        library = Path(folder) / "path.so"
        run_command(["cc", "-std=c99", "-O2", "-shared", "-fPIC", "-o", str(library), str(_HOOK)], "compiling path.c")
        return ctypes.CDLL(str(library))


class _Machine:
    """The processor with flash, RAM, a SysTick that stands still, and the semihosting that the image uses.

    The image reads SysTick before and after each measured call; what is executed in between is noted: instruction by
    instruction in main(), which does the reading, block by block elsewhere, which is faster.
    """

    def __init__(self, elf: Path, samples: bytes, words: list[str]) -> None:
        self._words = " ".join(words).encode() + b"\0"
        self._measuring = False
        self._measured = EMPTY
        self._wanted = range(0)
        self._paths: list[NDArray[np.uint64]] = []
        self._message = ""
        self._count = ctypes.c_uint32.in_dll(_hook(), "path_count")
        self._path = np.ctypeslib.as_array((ctypes.c_uint64 * _ROOM).in_dll(_hook(), "path"))
        self._uc = uc = unicorn.Uc(unicorn.UC_ARCH_ARM, unicorn.UC_MODE_THUMB | unicorn.UC_MODE_MCLASS)
        uc.ctl_set_cpu_model(arm_const.UC_CPU_ARM_CORTEX_M4)
        for address, size in ((_FLASH, _FLASH_BYTES), (_RAM, _RAM_BYTES), (_SYSTEM, _SYSTEM_BYTES)):
            uc.mem_map(address, size)
        uc.mem_write(_FLASH, _flash(elf))
        uc.mem_write(SAMPLES_ADDRESS, samples)
        uc.hook_add(unicorn.UC_HOOK_MEM_READ, self._on_clock, begin=_SYST_CVR, end=_SYST_CVR + 3)
        uc.hook_add(unicorn.UC_HOOK_INTR, self._on_exception)
        begin, size = next(entry[:2] for entry in functions(elf) if entry[2] == "main")
        self._note(unicorn.UC_HOOK_CODE, begin, begin + size)
        self._note(unicorn.UC_HOOK_BLOCK, _FLASH, begin)
        self._note(unicorn.UC_HOOK_BLOCK, begin + size, _FLASH + _FLASH_BYTES)

    def _note(self, kind: int, begin: int, end: int) -> None:
        """Have path_note() called for what is executed there; hook_add() takes functions in Python only."""
        note = engine.HOOK_CODE_CFUNC(("path_note", _hook()))
        handle = engine.uc_hook_h()
        status = engine.uclib.uc_hook_add(self._uc._uch, ctypes.byref(handle), kind, note, None, begin, end - 1)
        assert status == unicorn.UC_ERR_OK

    def run(self, first: int, last: int) -> list[NDArray[np.uint64]]:
        """Return the blocks that were executed in each of these samples, and the one after. Raise LeverError."""
        self._wanted = range(first, last + 1)
        stack, start = struct.unpack("<II", self._uc.mem_read(_FLASH, 8))
        self._uc.reg_write(arm_const.UC_ARM_REG_SP, stack)
        try:
            self._uc.emu_start(start | 1, 0)
        except unicorn.UcError as error:
            where = self._uc.reg_read(arm_const.UC_ARM_REG_PC)
            raise LeverError(f"the image in Unicorn: {error} at {where:#x}") from None
        if len(self._paths) < len(self._wanted):
            raise LeverError(f"the image in Unicorn ended early: {self._message}")
        return self._paths

    def _on_clock(self, uc: Any, _access: int, _address: int, _size: int, _value: int, _data: Any) -> None:
        """Comes after path_note() for the instruction that reads."""
        if self._measuring:
            if self._measured in self._wanted:
                assert self._count.value <= _ROOM, "a measured call takes more blocks than path.c has room for"
                self._paths.append(self._path[: self._count.value].copy())
            self._measured += 1
            if self._measured == self._wanted.stop:
                uc.emu_stop()
        self._measuring = not self._measuring
        self._count.value = 0

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
