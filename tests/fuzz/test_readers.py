"""Whatever is in a file, its reader gives a result, or says in one line what is wrong: a LeverError, nothing else.

The texts are good ones in which some places are replaced, always the same ones (`derandomize`)."""

from __future__ import annotations

import gzip
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from asammdf import MDF, Signal
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from lever_cdkf.can.logs import Recording
from lever_cdkf.errors import LeverError
from lever_cdkf.firmware import settings_file
from lever_cdkf.firmware.aircraft import read_response
from lever_cdkf.signals import bus_signals, mapping, tables
from lever_sil.aircraft import aircraft
from lever_sil.campaign import spec
from lever_sil.scenarios import scenario

EXAMPLES = 60
ROOT = Path(__file__).resolve().parents[2]
TOKENS = [
    *(
        b"",
        b"\x00",
        b"\xff",
        b"\xef\xbb\xbf",
        b"\n",
        b"\r\n",
        b"#",
        b"=",
        b'"',
        b"'",
        b"[",
        b"]",
        b"{",
        b"}",
        b",",
        b";",
    ),
    *(
        b"nan",
        b"inf",
        b"-1",
        b"0",
        b"1e999",
        b"1e-400",
        b"99999999999999999999",
        b"0x10",
        b"1_0",
        b"true",
        b"[]",
        b"''",
    ),
    *(
        b"1 furlong",
        b"-5 s",
        b"\xc2\xb5",
        b"\xe2\x88\x92",
        b"steady",
        b"lever",
        b"../..",
        b"/dev/null",
        b"kind",
        b"BO_ 1",
    ),
]
"""What is put in."""
MAPPED = b"""\
time = "Clock"
[theta]
signal = "Angle"
message = "Everything"
delay = 0.01
[theta_dot]
signal = "Rate"
unit = "deg/s"
sign = -1
[z_ddot]
signal = "Acceleration"
factor = 9.81
offset = "0.1 g"
gravity = "included"
channel = "vcan0"
[protected.Everything]
profile = 1
data_id = 291
counter = "Count"
"""
DATABASE = b"""\
VERSION ""
BU_: FCC
BO_ 512 Everything: 8 FCC
 SG_ Angle : 0|16@1- (0.005,0) [-90|90] "deg" FCC
 SG_ Mode M : 16|4@1+ (1,0) [0|15] "" FCC
 SG_ Acceleration m1 : 20|16@1- (0.0002,0) [-6|6] "g" FCC
CM_ SG_ 512 Angle "an angle";
VAL_ 512 Mode 0 "off" 1 "on" ;
BA_DEF_ BO_ "GenMsgCycleTime" INT 0 10000;
BA_DEF_DEF_ "GenMsgCycleTime" 100;
"""
LOG = b"""\
(1700000000.000100) vcan0 110#5E01000100020003 T
(1700000000.000200) vcan0 111#AB01020304050607 T
(1700000000.000300) vcan0 210#0011223344556677 R
(1700000000.000300) vcan0 12345678#00 R
(1700000000.000300) vcan0 123##1001122 R
"""
ASC = b"""\
date Thu Nov 16 10:00:00.000 2023
base hex  timestamps absolute
internal events logged
Begin Triggerblock Thu Nov 16 10:00:00.000 2023
   0.000100 1  110             Rx   d 8 5E 01 00 01 00 02 00 03
   0.000200 1  12345678x       Rx   d 2 01 02
End TriggerBlock
"""
TRC = b"""\
;$FILEVERSION=1.1
;$STARTTIME=45246.4166666667
;   Message Number
     1)         0.1  Rx         0110  8  5E 01 00 01 00 02 00 03
     2)         0.2  Rx     12345678  2  01 02
"""
CAN_CSV = b"""\
timestamp,arbitration_id,extended,remote,error,dlc,data
1.5,0x110,0,0,0,8,XgEAAQACAAM=
1.6,0x12345678,1,0,0,2,AQI=
"""
TABLE = b"""\
time [s];theta [deg];z_ddot
0,00;1,5;0,1
0,01;1,6;0,2
0,02;1,7;-0,3
0,03;1,8;0,1
"""


def mf4() -> bytes:
    """Return a file of two signals, as asammdf writes it."""
    time = np.arange(20) * 1e-3
    signals = [Signal(np.sin(time * k), time, name=f"signal {k}", unit="rad") for k in (1, 2)]
    with TemporaryDirectory() as folder, MDF(version="4.10") as file:
        file.append(signals, common_timebase=True)
        return Path(file.save(Path(folder) / "a.mf4")).read_bytes()


RESPONSE = b"gain_sigma = 0.1\nphase_sigma = 0.1 # rad\nwarning = 5\n1.5 -12.1 4.2\n2 -11 5\n3 1 1\n"
SETTINGS = b"model = hand\nsample_period = 2 ms # each\npreload=fixed\nm_p = .5e1\ntheta_noise = 1e-3 rad\n"


def read_log(path: str) -> None:
    for frames in Recording([path]).chunks():
        assert len(frames) >= 0


def make_config(path: str) -> None:
    settings_file.make_config(settings_file.read_assignments(path))


def read_scenario(path: str) -> None:
    scenario.load(path)


READERS: dict[str, tuple[str, bytes, Callable[[str], object]]] = {
    "settings": ("a.settings", SETTINGS, make_config),
    "response of an aircraft": ("a.response", RESPONSE, read_response),
    "mapping": ("a.toml", MAPPED, lambda path: mapping.read_mapping([path])),
    "database": ("a.dbc", DATABASE, bus_signals.load_database),
    "candump": ("a.log", LOG, read_log),
    "candump, packed": ("a.log.gz", LOG, read_log),
    "asc": ("a.asc", ASC, read_log),
    "trc": ("a.trc", TRC, read_log),
    "frames as csv": ("a.csv", CAN_CSV, read_log),
    "table": ("b.csv", TABLE, tables.read_table),
    "mf4": ("b.mf4", mf4(), tables.read_table),
    "mf4 of whatever": ("c.mf4", mf4(), tables.is_table),
    "scenario": ("a.toml", (ROOT / "sil/lever_sil/scenarios/sudden_grip.toml").read_bytes(), read_scenario),
    "campaign": ("a.toml", sorted((ROOT / "sil/lever_sil/campaign/specs").glob("*.toml"))[0].read_bytes(), spec.load),
    "aircraft": ("a.toml", (ROOT / "sil/lever_sil/aircraft/uh60_like.toml").read_bytes(), aircraft.load),
}
"""Name of a file, a good text, and what reads it."""


def changed(good: bytes, places: list[tuple[float, int, bytes]]) -> bytes:
    """Replace at each place (as a share of the text) so many bytes by others."""
    text = good
    for share, length, token in places:
        at = int(share * len(text))
        text = text[:at] + token + text[at + length :]
    return text


PLACES = st.lists(
    st.tuples(
        st.floats(0.0, 1.0), st.integers(0, 12), st.one_of(st.sampled_from(TOKENS), st.binary(max_size=4), st.just(b""))
    ),
    min_size=1,
    max_size=3,
)


@pytest.mark.parametrize("name", READERS)
def test_a_file_is_read_or_refused_in_a_line(name: str, tmp_path: Path) -> None:
    file, good, read = READERS[name]
    path = tmp_path / file
    store = gzip.compress if file.endswith(".gz") else bytes
    path.write_bytes(store(good))
    read(str(path))

    @settings(
        max_examples=EXAMPLES // 3 if "mf4" in name else EXAMPLES,  # asammdf takes a tenth of a second
        derandomize=True,
        database=None,
        deadline=None,
        phases=(Phase.generate,),
        suppress_health_check=list(HealthCheck),
    )
    @given(PLACES)
    def check(places: list[tuple[float, int, bytes]]) -> None:
        path.write_bytes(changed(store(good), places) if len(places) == 2 else store(changed(good, places)))
        said = ""
        try:
            read(str(path))
        except LeverError as error:
            said = str(error)
        assert "\n" not in said

    check()


@pytest.mark.parametrize(
    "text",
    [
        "protected = 5",
        "time = 5",
        "[protected.A]\ncounter = 5",
        "[protected.A]\nprofile = 1\ndata_id = 'x'",
        "[protected.A]\nprofile = 2\ndata_id = ['x', 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16]",
    ],
)
def test_a_mapping_of_the_wrong_types_is_refused(text: str, tmp_path: Path) -> None:
    """Once taken, or ended in another exception."""
    path = tmp_path / "a.toml"
    path.write_text(text)
    with pytest.raises(LeverError):
        mapping.read_mapping([str(path)])
