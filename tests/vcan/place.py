"""Runs a command where there is a CAN interface vcan0 that nobody else uses.

Where this machine's kernel has virtual CAN, that is a network namespace of its own, with or without root; where it has
not, User-Mode Linux (uml.py). Either way the command may add, take down and delete interfaces, and what it does to
them is gone afterwards.
"""

from __future__ import annotations

import functools
import os
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from typing import BinaryIO

from vcan import uml

INSIDE = "LEVER_VCAN"
"""Environment variable that is set for the command."""

_UP = 'ip link set lo up && ip link add dev vcan0 type vcan && ip link set vcan0 up && exec "$@"'
_PROBE = "import socket; socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW).bind(('vcan0',))"


def run(
    command: Sequence[str],
    *,
    environment: Mapping[str, str] | None = None,
    time_limit_s: float = 600.0,
    stdout: BinaryIO | None = None,
    stderr: BinaryIO | None = None,
    force_uml: bool = False,
) -> int:
    """Run `command` in the current folder and return its exit status. Raise the errors of uml.run()."""
    variables = {**(os.environ if environment is None else environment), INSIDE: "1"}
    if force_uml or not kernel_has_vcan():
        return uml.run(command, environment=variables, time_limit_s=time_limit_s, stdout=stdout, stderr=stderr)
    process = subprocess.Popen(
        [*_namespace(), *command],
        env=variables,
        stdin=subprocess.DEVNULL,
        stdout=stdout,
        stderr=stderr,
        start_new_session=True,
    )
    try:
        return process.wait(time_limit_s)
    except subprocess.TimeoutExpired:
        raise TimeoutError(f"no end within {time_limit_s:g} s: {command[0]}") from None
    finally:
        uml.end_group(process)


@functools.cache
def kernel_has_vcan() -> bool:
    """Return whether a network namespace with a vcan0 can be made here."""
    if shutil.which("unshare") is None or shutil.which("ip", path=_path()) is None:
        return False
    probe = [*_namespace(), sys.executable, "-c", _PROBE]
    return subprocess.run(probe, capture_output=True, check=False).returncode == 0


def _path() -> str:
    return os.pathsep.join((os.environ.get("PATH", os.defpath), "/usr/sbin", "/sbin"))


def _namespace() -> list[str]:
    """Return the command that makes the namespace; it takes what is to be run in it as further arguments."""
    user = () if os.geteuid() == 0 else ("--user", "--map-root-user")
    return ["unshare", *user, "--net", "env", f"PATH={_path()}", "sh", "-c", _UP, "sh"]
