"""What only installing gives: the entry points. Skipped where the package is not installed."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
import sysconfig
import time
from collections.abc import Callable
from importlib.machinery import PathFinder
from pathlib import Path

import can
import pytest
from lever_cdkf.can.bus import LeverBus
from lever_cdkf.firmware.native import Config
from processes import PATIENCE

pytestmark = pytest.mark.usefixtures("installed")

Samples = Callable[[int, int], list[tuple[tuple[int, bytes], tuple[int, bytes]]]]


def test_python_can_knows_the_interface(samples: Samples) -> None:
    assert "lever" in can.VALID_INTERFACES
    for arguments in ({"settings": {"m_p": 3.0}}, {"config": Config(settings={"m_p": 3.0})}):
        with can.Bus(interface="lever", channel="bench", **arguments) as bus:
            assert isinstance(bus, LeverBus)
            assert bus.estimator.estimate().parameter[0] == pytest.approx(3.0, rel=1e-5)
            for identifier, data in samples(0, 1)[0]:
                bus.send(can.Message(arbitration_id=identifier, is_extended_id=False, data=data))
            assert 0x210 in [answer.arbitration_id for answer in iter(bus.recv, None)]


def test_can_logger_opens_and_waits(tmp_path: Path) -> None:
    program = (
        "import sys; sys.modules['asammdf'] = None; from can.logger import main; main()"  # whose loading takes long
    )
    logger = [sys.executable, "-u", "-c", program, "-i", "lever", "-c", "bench", "-f", str(tmp_path / "a.log")]
    with subprocess.Popen(logger, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "Connected to LeverBus: lever firmware in this process, channel 'bench'\n"
        process.stdout.readline()
        time.sleep(0.3)
        used = sum(map(int, Path(f"/proc/{process.pid}/stat").read_text().rsplit(")", 1)[1].split()[11:13]))
        time.sleep(0.3)
        after = sum(map(int, Path(f"/proc/{process.pid}/stat").read_text().rsplit(")", 1)[1].split()[11:13]))
        process.send_signal(signal.SIGINT)
        assert process.wait(PATIENCE) == 0
    assert after - used <= 10  # hundredths of a second: it waits, and does not go round


def test_the_tree_is_what_is_tested(root: Path) -> None:
    """An edit of a Python file counts without a build step, here and in every process that a test starts."""
    code = "import lever_cdkf, lever_sil; print(lever_cdkf.__file__, lever_sil.__file__)"
    files = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert files == [str(root / folder / "__init__.py") for folder in ("host_tools/lever_cdkf", "sil/lever_sil")]


def test_editors_and_type_checkers_find_the_packages(root: Path) -> None:
    """They run no import hook: they follow the folders that the .pth files of the environment name."""
    files = Path(sysconfig.get_path("purelib")).glob("*.pth")
    lines = [line for file in files for line in file.read_text(encoding="utf-8").splitlines()]
    folders = [line for line in lines if not line.startswith("import ")]
    for name, folder in (("lever_cdkf", "host_tools"), ("lever_sil", "sil")):
        spec = PathFinder.find_spec(name, folders)
        assert spec is not None
        assert spec.origin == str(root / folder / name / "__init__.py")
        assert (root / folder / name / "py.typed").is_file()


def test_versions_agree(installed: str, root: Path) -> None:
    header = (root / "firmware/lever_cdkf.h").read_text()
    parts = re.findall(r"#define LEVER_VERSION_(?:MAJOR|MINOR|PATCH) (\d+)", header)
    assert installed == ".".join(parts)
