"""Runs a command inside User-Mode Linux, a Linux kernel that is an ordinary process, with CAN interface vcan0 up.

For machines whose own kernel has no CAN; __main__.py has a command line. The command sees this machine's whole file
system (hostfs, writable), in the given folder and environment, as root of a kernel of its own with one processor; what
it prints is passed on as it comes.

Debian packages: user-mode-linux busybox-static iproute2, installed, or extracted with `dpkg -x` into the folder that
the environment variable LEVER_SYSROOT names.
"""

from __future__ import annotations

import contextlib
import os
import re
import selectors
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

PACKAGES = "user-mode-linux busybox-static iproute2"
MODULES = ("net/can/can.ko", "net/can/can-raw.ko", "drivers/net/can/dev/can-dev.ko", "drivers/net/can/vcan.ko")
OPTIONAL_MODULES = ("net/sched/sch_tbf.ko", "net/can/can-gw.ko", "drivers/net/can/slcan/slcan.ko")
_POLL_S = 0.1


class UmlError(Exception):
    """User-Mode Linux is not installed, or did not do what it should; one line."""


@dataclass(frozen=True)
class Machine:
    """Where the parts of User-Mode Linux are."""

    kernel: Path
    modules: Path
    """The folder `kernel` of its modules."""
    busybox: Path
    sysroot: Path | None


def find_machine() -> Machine:
    """Look in LEVER_SYSROOT, then among the installed programs. Raise UmlError when a part is missing."""
    given = os.environ.get("LEVER_SYSROOT")
    sysroot = Path(given).resolve() if given else None
    kernel = _find_program("linux.uml", sysroot)
    version = subprocess.run([kernel, "--version"], capture_output=True, text=True, check=False).stdout.strip()
    modules = kernel.parent.parent / "lib/uml/modules" / version / "kernel"
    if not (modules / MODULES[0]).exists():
        raise UmlError(f"{modules}: no CAN modules for {kernel}: apt install --reinstall user-mode-linux")
    _find_program("ip", sysroot)
    return Machine(kernel, modules, _find_program("busybox", sysroot), sysroot)


def run(
    command: Sequence[str],
    *,
    cwd: Path | None = None,
    environment: Mapping[str, str] | None = None,
    time_limit_s: float = 600.0,
    memory: str = "1G",
    stdout: BinaryIO | None = None,
    stderr: BinaryIO | None = None,
) -> int:
    """Boots, runs `command` in `cwd` (default: here) with `environment` (default: ours), returns its exit status.

    Its output goes to `stdout` and `stderr` (default: ours) while it runs. Takes about 2 s more than the command.
    Raises UmlError if there is no machine, and TimeoutError after `time_limit_s`. Leaves no process behind either way.
    """
    machine = find_machine()
    sinks = (stdout or sys.stdout.buffer, stderr or sys.stderr.buffer)
    with tempfile.TemporaryDirectory(prefix=f"lever-uml-{os.getpid()}-") as folder:
        place = Path(folder)
        init = _init_script(
            machine, command, cwd or Path.cwd(), os.environ if environment is None else environment, place
        )
        (place / "init").write_text(init)
        (place / "init").chmod(0o755)
        with _started(machine, place, memory) as (process, outputs):
            in_time = _pass_on(process, dict(zip(outputs, sinks, strict=True)), time.monotonic() + time_limit_s)
        if not in_time:
            raise TimeoutError(f"no end within {time_limit_s:g} s: {shlex.join(command)}")
        return _read_status(place)


def _find_program(name: str, sysroot: Path | None) -> Path:
    folders = [str(sysroot / part) for part in ("usr/bin", "usr/sbin", "bin", "sbin")] if sysroot else []
    folders += [*os.environ.get("PATH", os.defpath).split(os.pathsep), "/usr/sbin", "/sbin"]
    found = shutil.which(name, path=os.pathsep.join(folders))
    if found is None:
        raise UmlError(f"no {name} here, which User-Mode Linux needs: apt install {PACKAGES}")
    return Path(found)


def _init_script(
    machine: Machine, command: Sequence[str], cwd: Path, environment: Mapping[str, str], place: Path
) -> str:
    """Return the first process of the machine: sets it up, runs the command, leaves the exit status in place/status.

    The command writes into pipes, not into the serial lines, so that it does not take them for a terminal. What it
    leaves running in the background is ended with it.
    """
    variables = dict(environment)
    folders = [variables.get("PATH", os.defpath), "/usr/sbin", "/sbin"]
    if machine.sysroot:
        folders = [*(str(machine.sysroot / part) for part in ("usr/bin", "usr/sbin", "bin", "sbin")), *folders]
        libraries = [variables.get("LD_LIBRARY_PATH"), str(machine.sysroot / "usr/lib/x86_64-linux-gnu")]
        variables["LD_LIBRARY_PATH"] = os.pathsep.join(part for part in libraries if part)
    variables["PATH"] = os.pathsep.join(folders)
    names = [name for name in variables if re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", name)]
    exports = "\n".join(f"export {name}={shlex.quote(variables[name])}" for name in names)
    busybox = shlex.quote(str(machine.busybox))
    modules = "\n".join(f"{busybox} insmod {shlex.quote(str(machine.modules / name))}" for name in MODULES)
    optional = "\n".join(
        f"{busybox} insmod {shlex.quote(str(machine.modules / n))} 2>/dev/null" for n in OPTIONAL_MODULES
    )
    return f"""#!/bin/sh
cd {shlex.quote(str(place))}
{busybox} mount -t proc proc /proc
{busybox} mount -t sysfs sys /sys
[ -e /dev/ttyS0 ] || {busybox} mount -t devtmpfs dev /dev
{busybox} mkdir -p /dev/pts /dev/shm
{busybox} mount -t devpts pts /dev/pts
{busybox} mount -t tmpfs shm /dev/shm
{exports}
{modules}
{optional}
ip link set lo up && ip link add dev vcan0 type vcan && ip link set vcan0 up && : >booted
{busybox} mkfifo /dev/lever.out /dev/lever.err
{busybox} stty raw -F /dev/ttyS0
{busybox} stty raw -F /dev/ttyS1
{busybox} cat /dev/lever.out >/dev/ttyS0 & out=$!
{busybox} cat /dev/lever.err >/dev/ttyS1 & err=$!
if [ -e booted ]; then
    (cd {shlex.quote(str(cwd))} && exec {shlex.join(command)}) </dev/null >/dev/lever.out 2>/dev/lever.err
    echo $? >status
fi
for process in /proc/[0-9]*; do
    process=${{process#/proc/}}
    case $process in 1|$out|$err) ;; *) kill -9 "$process" 2>/dev/null ;; esac
done
[ -e booted ] && wait $out $err
{busybox} sync
{busybox} poweroff -f
"""


@contextlib.contextmanager
def _started(machine: Machine, place: Path, memory: str) -> Generator[tuple[subprocess.Popen[bytes], tuple[int, int]]]:
    """Yield the machine's process and where its two serial lines (the command's stdout and stderr) can be read.

    All its processes are in one new process group, which ends with this context; should we be killed ourselves, they
    get SIGTERM from the kernel.
    """
    lines = (os.pipe(), os.pipe())
    writers = tuple(line[1] for line in lines)
    arguments = [
        *("setpriv", "--pdeathsig", "TERM", str(machine.kernel)),
        *("rootfstype=hostfs", "hostfs=/", "rw", f"init={place}/init", f"mem={memory}", "quiet"),
        *(f"uml_dir={place}/", "umid=machine", "con=null", "con0=null,fd:1"),
        *(f"ssl{i}=null,fd:{writer}" for i, writer in enumerate(writers)),
    ]
    with (place / "console").open("wb") as console:
        process = subprocess.Popen(
            arguments,
            stdin=subprocess.DEVNULL,
            stdout=console,
            stderr=console,
            env={"PATH": os.environ.get("PATH", os.defpath), "TMPDIR": _memory_folder(memory), **_preloaded(place)},
            pass_fds=writers,
            start_new_session=True,
        )
    for writer in writers:
        os.close(writer)
    try:
        yield process, (lines[0][0], lines[1][0])
    finally:
        end_group(process)
        for reader, _ in lines:
            os.close(reader)


def _preloaded(place: Path) -> dict[str, str]:
    """Return what makes the machine run on processors that are newer than it, as environment; xstate.c says why."""
    compiler = next((found for name in ("cc", "gcc", "clang") if (found := shutil.which(name))), None)
    if compiler is None:
        return {}
    library = place / "xstate.so"
    source = Path(__file__).with_name("xstate.c")
    subprocess.run([compiler, "-O1", "-shared", "-fPIC", str(source), "-o", str(library), "-ldl"], check=True)
    return {"LD_PRELOAD": str(library)}


def end_group(process: subprocess.Popen[bytes]) -> None:
    """Kills all processes of the group and waits, for at most a second, until they are gone."""
    with contextlib.suppress(ProcessLookupError):
        for _ in range(100):
            os.killpg(process.pid, signal.SIGKILL)
            process.poll()
            time.sleep(0.01)


def _memory_folder(memory: str) -> str:
    """Return the folder for the file that is the machine's memory: it must allow execution and have room."""
    size = int(memory[:-1]) << {"M": 20, "G": 30}[memory[-1]]
    for folder in ("/dev/shm", tempfile.gettempdir(), "/var/tmp"):
        with contextlib.suppress(OSError):
            system = os.statvfs(folder)
            if not system.f_flag & os.ST_NOEXEC and system.f_bavail * system.f_frsize >= size:
                return folder
    raise UmlError(f"no {memory} bytes free in /dev/shm or {tempfile.gettempdir()} for the memory of User-Mode Linux")


def _pass_on(process: subprocess.Popen[bytes], sinks: Mapping[int, BinaryIO], end: float) -> bool:
    """Copy each line to its sink until the machine is off (True) or time.monotonic() reaches `end` (False)."""
    with selectors.DefaultSelector() as selector:
        for reader in sinks:
            selector.register(reader, selectors.EVENT_READ)
        while time.monotonic() < end:
            off = process.poll() is not None
            for key, _ in selector.select(timeout=0.0 if off else _POLL_S):
                data = os.read(key.fd, 65536)
                if data:
                    sinks[key.fd].write(data)
                    sinks[key.fd].flush()
                else:
                    selector.unregister(key.fd)
            if off:
                return True
    return False


def _read_status(place: Path) -> int:
    try:
        return int((place / "status").read_text())
    except (OSError, ValueError):
        console = (place / "console").read_text(errors="replace").strip().splitlines()
        said = console[-1] if console else "nothing"
        raise UmlError(f"User-Mode Linux did not run the command; its console ends with: {said}") from None
