"""The picture of a result for a README: the top of a report (verdict, figures, the pilot's parameters) as a PNG.

    python tests/screenshot.py build/demo/report.html picture.png

Needs Chromium (Debian: chromium) on the PATH; the tests of pages use it, too.
"""

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from lever_cdkf.errors import LeverError

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
OFFLINE = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--virtual-time-budget=15000"),
    *("--disable-quic", "--disable-background-networking", "--disable-component-update", "--disable-sync"),
    "--no-first-run",
)
SIZE = (1280, 700)  # [pixels]


def browse(url: str, *options: str) -> subprocess.CompletedProcess[str]:
    """Open `url` in a headless browser that keeps and fetches nothing. Raise LeverError when there is none."""
    browser = next((path for name in BROWSERS if (path := shutil.which(name))), None)
    if browser is None:
        raise LeverError(f"none of {', '.join(BROWSERS)} is on the PATH: apt-get install chromium")
    with tempfile.TemporaryDirectory(prefix="lever-browser-", ignore_cleanup_errors=True) as profile:
        command = [browser, *OFFLINE, f"--user-data-dir={profile}", *options, url]
        return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)


def write_picture(report: str | os.PathLike[str], path: str | os.PathLike[str]) -> None:
    """Write the PNG. Raise LeverError when it cannot."""
    page, final = Path(report).resolve(), Path(path).resolve()
    if not page.is_file():
        raise LeverError(f"{report}: no such report; `lever demo` makes one")
    temporary = final.with_name(f".{final.name}.{os.getpid()}.png")
    try:
        size = f"--window-size={SIZE[0]},{SIZE[1]}"
        result = browse(f"{page.as_uri()}#picture", f"--screenshot={temporary}", size)
        if not temporary.is_file():
            raise LeverError(f"{final}: the browser made no picture (status {result.returncode})")
        os.replace(temporary, final)
    finally:
        temporary.unlink(missing_ok=True)


def main(arguments: list[str]) -> int:
    if len(arguments) != 2:
        print("usage: python tests/screenshot.py REPORT.html PICTURE.png", file=sys.stderr)
        return 2
    try:
        write_picture(*arguments)
    except LeverError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
