"""Fetches the sources of Unity (unity.c, unity.h, unity_internals.h) into a folder.

    venv/bin/python fetch_unity.py DIR

They come out of the source package pinned, with its hash, in unity.txt; nothing of that package is built or installed.
Exits 1 with one line on stderr when it cannot be had.
"""

from __future__ import annotations

import subprocess
import sys
import tarfile
import tempfile
from pathlib import Path

PINNED = Path(__file__).with_name("unity.txt")
FILES = ("unity.c", "unity.h", "unity_internals.h")


def download(folder: Path) -> Path:
    pip = [sys.executable, "-m", "pip", "download", "--quiet", "--disable-pip-version-check", "--no-input"]
    source_only = ["--no-deps", "--no-binary", ":all:", "--require-hashes", "--requirement", str(PINNED)]
    if subprocess.run([*pip, *source_only, "--dest", str(folder)], check=False).returncode != 0:
        raise RuntimeError(f"pip could not fetch the source package of {PINNED.name} (its reason is above)")
    (archive,) = folder.iterdir()
    return archive


def main() -> int:
    destination = Path(sys.argv[1])
    try:
        with tempfile.TemporaryDirectory() as scratch, tarfile.open(download(Path(scratch))) as archive:
            for member in archive.getmembers():
                folder, _, name = member.name.rpartition("/")
                source = archive.extractfile(member)
                if folder.endswith("third_party/unity") and name in FILES and source is not None:
                    destination.mkdir(parents=True, exist_ok=True)
                    (destination / name).write_bytes(source.read())
    except (RuntimeError, OSError, tarfile.TarError) as error:
        print(f"tests/setup/fetch_unity.py: {error}", file=sys.stderr)
        return 1
    missing = [name for name in FILES if not (destination / name).exists()]
    if missing:
        print(f"tests/setup/fetch_unity.py: {', '.join(missing)} not in the package", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
