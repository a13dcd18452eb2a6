"""Makes and fills the virtual environment that the demo and the tests run in.

    python3 venv.py DIR install   the project with what `lever demo` needs; its Python files stay in the tree
    python3 venv.py DIR tools     all extras, and the tools that the tests use (group "test" of pyproject.toml)

Versions are those of constraints.txt. Nothing is fetched when the environment has them already. Needs nothing but the
standard library; exits 1 with one line on stderr when something is lacking.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

SETUP = Path(__file__).resolve().parent
ROOT = SETUP.parent.parent


class SetupError(Exception):
    """What is lacking and what to do, in one line."""


def succeeds(*command: str | Path) -> bool:
    """Return whether the command can be run and exits with 0; says nothing."""
    try:
        return subprocess.run(command, capture_output=True, check=False).returncode == 0
    except OSError:
        return False


def is_usable(venv: Path) -> bool:
    """Return whether the environment has a pip, and the Python that is asked for now."""
    same_python = f"import sys; sys.exit(sys.version_info[:3] != {tuple(sys.version_info[:3])})"
    return succeeds(venv / "bin/python", "-c", same_python) and succeeds(venv / "bin/python", "-m", "pip", "--version")


def create(venv: Path) -> None:
    """Make an empty environment with pip, whether or not this Python can bootstrap pip (Debian's without
    python3-venv cannot)."""
    shutil.rmtree(venv, ignore_errors=True)
    if succeeds(sys.executable, "-m", "venv", venv):
        return
    shutil.rmtree(venv, ignore_errors=True)
    pip_of_system = (sys.executable, "-m", "pip", "--python", venv / "bin/python", "install", "--quiet", "pip")
    if not (succeeds(sys.executable, "-m", "venv", "--without-pip", venv) and succeeds(*pip_of_system)):
        shutil.rmtree(venv, ignore_errors=True)
        raise SetupError(f"{sys.executable} has neither venv nor pip: install them (Debian: apt install python3-venv)")


def pip_install(venv: Path, what: str, *arguments: str) -> None:
    """pip install under the constraints; its own messages are shown only when something is wrong."""
    print(f"-- {venv}: installing {what}", flush=True)
    fixed = ["--quiet", "--disable-pip-version-check", "--no-input", "--constraint", str(SETUP / "constraints.txt")]
    command = [str(venv / "bin/python"), "-m", "pip", "install", *fixed, *arguments]
    if subprocess.run(command, cwd=ROOT, check=False).returncode != 0:
        hint = "if it reached no package index, say where one is with PIP_INDEX_URL"
        raise SetupError(f"pip could not install {what} for the reason above; {hint}")


def main() -> int:
    venv, step = Path(sys.argv[1]).absolute(), sys.argv[2]
    try:
        if not is_usable(venv):
            create(venv)
        pip_install(venv, "pip", "pip")
        if step == "install":
            pip_install(venv, "what builds the project", "--group", "build")
            build_dir = f"build-dir={venv.parent / 'wheel'}"
            editable = ("--no-build-isolation", "--config-settings", build_dir, "--editable", f"{ROOT}[report]")
            pip_install(venv, "the project", *editable)
        else:
            pip_install(venv, "all extras and the test tools", "lever-cdkf[all]", "--group", "test")
    except SetupError as error:
        print(f"tests/setup/venv.py: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
