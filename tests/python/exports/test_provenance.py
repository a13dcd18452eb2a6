"""Where an output comes from."""

from __future__ import annotations

import hashlib
import json
import re
import shutil
import subprocess
import sys
from argparse import Namespace
from datetime import datetime, timezone
from pathlib import Path

import lever_cdkf
import pytest
from lever_cdkf.cli.main import main
from lever_cdkf.commands.options import input_files
from lever_cdkf.errors import LeverError
from lever_cdkf.firmware.settings_file import read_assignments
from lever_cdkf.runtime import provenance as origin
from lever_cdkf.runtime.files import LIBRARY_DIR, native_file, shared_library
from lever_cdkf.runtime.provenance import provenance, with_provenance
from python.conftest import Session


def test_the_date_is_now_or_that_of_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("SOURCE_DATE_EPOCH", raising=False)
    before = datetime.now(tz=timezone.utc).replace(microsecond=0)
    assert before <= provenance().moment() <= datetime.now(tz=timezone.utc)
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1234567890")
    assert provenance().created == "2009-02-13T23:31:30Z"
    for wrong in ("yesterday", "1e400", "9" * 30):
        monkeypatch.setenv("SOURCE_DATE_EPOCH", wrong)
        with pytest.raises(LeverError, match="SOURCE_DATE_EPOCH"):
            provenance()


def test_a_settings_file_that_a_long_command_has_written_can_be_read(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    words = ["/bin/lever", "tune", *(f"flight\N{MULTIPLICATION SIGN}{index}.log" for index in range(300)), "x" * 2000]
    monkeypatch.setattr(sys, "argv", words)
    path = tmp_path / "long.settings"
    path.write_text(provenance().comment() + "theta_noise = 0.002\n", encoding="utf-8")
    assert read_assignments(path) == {"theta_noise": pytest.approx(0.002)}
    assert all(len(line) <= 510 for line in path.read_bytes().splitlines())


def test_inputs_are_told_by_the_hash_of_their_bytes(tmp_path: Path) -> None:
    (tmp_path / "Größe θ.log").write_bytes(b"abc")
    provided = provenance([tmp_path / "Größe θ.log", "-", tmp_path])
    assert provided.inputs == {
        f"{tmp_path}/Größe θ.log": f"sha256:{hashlib.sha256(b'abc').hexdigest()}",
        "-": None,
        str(tmp_path): None,
    }
    library = native_file(shared_library("lever_cdkf"))
    assert provided.library == f"sha256:{hashlib.sha256(library.read_bytes()).hexdigest()}"


def test_inputs_are_all_files_that_options_name(tmp_path: Path) -> None:
    aircraft = tmp_path / "own.toml"
    aircraft.touch()
    options = Namespace(
        settings="my.settings", dbc="my.dbc", map=["theta=A.B", "my.TOML"], aircraft=f"{aircraft},gearing=2"
    )
    assert input_files(options) == ["my.settings", "my.dbc", str(aircraft), "my.TOML"]


def test_every_format_can_hold_the_names(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", ["/bin/lever", "replay", "a b\x07\udcff.log"])
    provided = provenance(["a\x00\udcff"])
    assert provided.command == r"lever replay 'a b\x07\udcff.log'"
    assert list(provided.inputs) == [r"a\x00\udcff"]
    assert json.loads(provided.text())["command"] == provided.command


@pytest.mark.requires("git")
def test_the_revision_is_that_of_the_tree_of_the_package_and_of_no_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def git(*arguments: str) -> str:
        settings = ("-c", "user.name=x", "-c", "user.email=x@y")
        done = subprocess.run(
            ["git", "-C", tmp_path, *settings, *arguments], capture_output=True, text=True, check=True
        )
        return done.stdout.strip()

    package = tmp_path / "host_tools/lever_cdkf/runtime"
    package.mkdir(parents=True)
    shutil.copy(str(origin.__file__), package / "provenance.py")
    monkeypatch.setattr(origin, "__file__", str(package / "provenance.py"))
    asked = origin.revision.__wrapped__
    assert asked() is None
    git("init", "-q")
    git("add", ".")
    git("commit", "-qm", "first")
    assert asked() == git("rev-parse", "--short=12", "HEAD")
    (package / "provenance.py").write_text("")
    assert asked() == git("rev-parse", "--short=12", "HEAD") + "-dirty"
    for folder in ("env/site-packages/lever_cdkf", "env/lever_cdkf"):  # in somebody's own tree
        inside = tmp_path / folder
        inside.mkdir(parents=True)
        monkeypatch.setattr(origin, "__file__", str(inside / "provenance.py"))
        monkeypatch.setenv(LIBRARY_DIR, str(inside))
        monkeypatch.setattr(lever_cdkf, "__path__", [])
        assert asked() is None
        (inside / "revision.txt").write_text("0123456789ab\n")  # as firmware/CMakeLists.txt leaves it
        assert asked() == "0123456789ab"


def test_rows_in_json_have_it(session: Session, tmp_path: Path) -> None:
    assert main(["replay", str(session.log), "--json", str(tmp_path / "rows.json")]) == 0
    provided = json.loads((tmp_path / "rows.json").read_text())["provenance"]
    assert provided["version"] == origin.version()
    assert provided["inputs"] == {str(session.log): origin.sha256(session.log)}


def test_a_page_says_it_at_its_end() -> None:
    provided = provenance(["</script><b>"])
    page = with_provenance("<html><body><p>x</p></body></html>", provided)
    assert page.startswith("<html><body><p>x</p><footer>")
    assert page.endswith("</body></html>")
    kept = '<script type="application/json" id="provenance">(.*?)</script>'
    (content,) = re.findall(kept, page)
    assert json.loads(content) == provided.properties()
    assert "<b>" not in re.sub(kept, "", page)
    assert with_provenance("<html></html>", None) == "<html></html>"
    assert with_provenance("<html></html>", provided).endswith("</html>")
