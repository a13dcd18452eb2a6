"""E2E protection that a mapping names is checked; what it does not name is counted as unprotected."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from e2e.p01 import e2e_p01_protect
from e2e.p05 import e2e_p05_protect
from lever_cdkf.errors import LeverError
from lever_cdkf.signals.mapping import read_mapping
from lever_cdkf.signals.reading import Loaded, Reading, read
from python.conftest import Session

DATABASE = """VERSION ""
BU_: A
BO_ 291 Protected: 8 A
 SG_ Crc : 0|8@1+ (1,0) [0|0] "" A
 SG_ Count : {counter} (1,0) [0|0] "" A
 SG_ Angle : 24|16@1- (0.001,0) [0|0] "rad" A
 SG_ Acc : 40|16@1- (0.001,0) [0|0] "m/s^2" A
"""


def protected_frames(folder: Path, profile: int, wrong: tuple[int, ...] = (), lost: tuple[int, ...] = ()) -> Loaded:
    """200 protected frames, of which some have a flipped bit and some never came."""
    lines = []
    for k in range(200):
        body = (300 + k % 5).to_bytes(2, "little") + (9800 + k % 7).to_bytes(2, "little")
        data = bytearray(8)
        data[3:7] = body
        if profile == 1:
            data[1] = k % 15
            e2e_p01_protect(data, 0x1A2, increment_counter=False)
        else:
            data[2] = k % 256
            e2e_p05_protect(data, 0x1A2, increment_counter=False)
        data[4] ^= k in wrong
        if k not in lost:
            lines.append(f"({1.0 + 2e-3 * k:.6f}) can0 123#{data.hex().upper()}\n")
    (folder / "protected.log").write_text("".join(lines))
    (folder / "protected.dbc").write_text(DATABASE.format(counter="8|4@1+" if profile == 1 else "16|8@1+"))
    (folder / "m.toml").write_text(
        f'[protected.Protected]\nprofile = {profile}\ndata_id = 0x1A2\ncounter = "Count"\n'
        '[theta]\nsignal = "Angle"\n[z_ddot]\nsignal = "Acc"\n'
    )
    mapping = read_mapping([str(folder / "m.toml")])
    return read([folder / "protected.log"], Reading(mapping, str(folder / "protected.dbc")))


@pytest.mark.parametrize("profile", [1, 5])
def test_profiles_of_foreign_messages(profile: int, tmp_path: Path) -> None:
    right = protected_frames(tmp_path, profile)
    assert (right.counts["Protected"].corrupt, right.counts["Protected"].lost, right.unprotected) == (0, 0, 0)
    wrong = protected_frames(tmp_path, profile, wrong=(17, 100, 101), lost=(60, 61))
    counts = wrong.counts["Protected"]
    assert (counts.frames, counts.corrupt, counts.repeated) == (198, 3, 0)
    assert counts.lost == 5  # a corrupt frame leaves a gap in the counter, too
    sent = 1_000_000 + 2000 * np.delete(np.arange(200), [17, 60, 61, 100, 101])
    np.testing.assert_array_equal(wrong.samples.time_us, sent)


def test_profile_2_is_that_of_lever_dbc(session: Session, root: Path, tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_text(
        "[protected.LEVER_SAMPLE]\nprofile = 2\ncounter = 'counter'\n"
        f"data_id = {list(range(1, 17))}\n"
        "[theta]\nsignal = 'LEVER_SAMPLE.theta'\n[z_ddot]\nsignal = 'BASE_SAMPLE.z_ddot'\n"
    )
    reading = Reading(read_mapping([str(tmp_path / "m.toml")]), str(root / "firmware/can/lever.dbc"))
    right = read([session.log], reading)
    assert (right.counts["LEVER_SAMPLE"].corrupt, right.counts["LEVER_SAMPLE"].lost) == (0, 0)
    assert right.unprotected == right.counts["BASE_SAMPLE"].frames > 0
    lines = session.lines
    places = [k for k, line in enumerate(lines) if " 110#" in line][1000:1003]
    for k in places:
        head, data = lines[k].split("#")
        lines[k] = f"{head}#{data[:4]}{'0' if data[4] != '0' else '1'}{data[5:]}"
    (tmp_path / "wrong.log").write_text("\n".join(lines) + "\n")
    assert read([tmp_path / "wrong.log"], reading).counts["LEVER_SAMPLE"].corrupt == 3


def test_a_counter_that_is_not_there(session: Session, root: Path, tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_text("[protected.LEVER_SAMPLE]\ncounter = 'count'\n")
    mapping = read_mapping([str(tmp_path / "m.toml"), "theta=LEVER_SAMPLE.theta", "z_ddot=BASE_SAMPLE.z_ddot"])
    with pytest.raises(LeverError, match=r"no signal LEVER_SAMPLE\.count; near to it: counter"):
        read([session.log], Reading(mapping, str(root / "firmware/can/lever.dbc")))


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ("profile = 3\ndata_id = 1", "profile = 3; it may be 1, 2 or 5"),
        ("profile = 2\ndata_id = 1", "a list of sixteen bytes"),
        ("data_id = 1", "neither a profile nor a counter"),
        ("crc = 'x'", "it may have profile, data_id and counter, not crc"),
    ],
)
def test_what_is_wrong_with_a_protection(table: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_text(f"[protected.X]\n{table}\n")
    with pytest.raises(LeverError, match=said):
        read_mapping([str(tmp_path / "m.toml"), "theta=a", "z_ddot=b"])
