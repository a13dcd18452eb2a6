"""Installs the Debian packages of debian-packages.txt that are missing, on a machine that is there for testing only.

That is: CI or LEVER_REQUIRE_ALL is set, the user is root and there is an apt-get. On anyone else's machine nothing is
touched; tests that need a missing tool say so and skip.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

PACKAGES = Path(__file__).with_name("debian-packages.txt")


def packages() -> list[str]:
    lines = PACKAGES.read_text(encoding="utf-8").splitlines()
    return [line.split()[0] for line in lines if line.strip() and not line.startswith("#")]


def is_installed(package: str) -> bool:
    query = ["dpkg-query", "--show", "--showformat=${db:Status-Status}", package]
    return subprocess.run(query, capture_output=True, text=True, check=False).stdout == "installed"


def main() -> int:
    is_test_machine = os.environ.get("CI") == "true" or os.environ.get("LEVER_REQUIRE_ALL") == "1"
    if not is_test_machine or os.geteuid() != 0 or shutil.which("apt-get") is None:
        return 0
    missing = [package for package in packages() if not is_installed(package)]
    if not missing:
        return 0
    print(f"-- installing {' '.join(missing)}", flush=True)
    install = ["apt-get", "install", "--yes", "--quiet", "--no-install-recommends", *missing]
    environment = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
    for command in (["apt-get", "update", "--quiet"], install):
        result = subprocess.run(
            command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False
        )
        if result.returncode != 0:
            print(result.stdout, file=sys.stderr)
            print(f"tests/setup/system_packages.py: {' '.join(command)} failed (its output is above)", file=sys.stderr)
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
