"""wheel.py OUT: what test_wheel.py looks at. In OUT: the source distribution, and `installed`, what pip makes of it."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

_SDIST = "import sys; from scikit_build_core.build import build_sdist; build_sdist(sys.argv[1])"
_PIP = ("-m", "pip", "--quiet", "install", "--no-index", "--no-deps", "--no-build-isolation")
_QUICK = "--config-settings=cmake.build-type=Debug"

out = Path(sys.argv[1])
shutil.rmtree(out, ignore_errors=True)
out.mkdir()
subprocess.run([sys.executable, "-c", _SDIST, out], check=True)
(archive,) = out.iterdir()
subprocess.run([sys.executable, *_PIP, _QUICK, "--target", out / "installed", archive], check=True)
