"""The files with the signals of a run, each by a reader of its own: asammdf, mcap, pyarrow and polars."""

from __future__ import annotations

import hashlib
import json
import shutil
from collections import defaultdict
from dataclasses import dataclass
from datetime import datetime, timedelta, timezone
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import cantools
import numpy as np
import pandas as pd
import polars as pl
import pytest
from asammdf import MDF
from lever_cdkf.cli.formats import FORMATS
from lever_cdkf.cli.main import main
from lever_cdkf.errors import LeverError
from lever_cdkf.exports.signal_files import SignalFiles
from lever_cdkf.results.trace import Trace
from lever_cdkf.runtime.provenance import provenance
from mcap.reader import make_reader
from processes import full_disk
from pyarrow import parquet
from python.conftest import Refused, Session, simulated

START = datetime(2024, 5, 17, 10, 20, 30, 123456, tzinfo=timezone.utc)
EPOCH = datetime(1970, 1, 1, tzinfo=timezone.utc)
ALL = ("--format", ",".join(FORMATS))


@dataclass(frozen=True)
class Replayed:
    """A log with a date, and what `lever replay` makes of it."""

    log: Path
    folder: Path
    table: pd.DataFrame
    """Of trace.csv."""
    dbc: Any

    def frames(self, name: str) -> list[tuple[int, dict[str, Any]]]:
        """Return time [us since 1970] and signals of a message, decoded by cantools."""
        message = self.dbc.get_message_by_name(name)
        rows = (line.split() for line in self.log.read_text().splitlines())
        return [
            (int(time[1:-1].replace(".", "")), message.decode(bytes.fromhex(frame[4:])))
            for time, _, frame, _ in rows
            if int(frame[:3], 16) == message.frame_id
        ]


@pytest.fixture(scope="module")
def replayed(session: Session, root: Path, tmp_path_factory: pytest.TempPathFactory) -> Replayed:
    folder = tmp_path_factory.mktemp("exports")
    log, out = folder / "dated.log", folder / "out"
    offset = (START - EPOCH) // timedelta(microseconds=1)
    with log.open("w") as file:
        for line in session.lines:
            time, rest = line[1:].split(")", 1)
            at = offset + int(time.replace(".", ""))
            file.write(f"({at // 1_000_000}.{at % 1_000_000:06d}){rest}\n")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SOURCE_DATE_EPOCH", "1700000000")
        assert main(["replay", str(log), "-o", str(out), *ALL]) == 0
    dbc = cantools.database.load_file(root / "firmware/can/lever.dbc")
    return Replayed(log, out, pd.read_csv(out / "trace.csv"), dbc)


@pytest.fixture(scope="module")
def simulation(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("simulation") / "out"
    short = ("--set", "duration=3 s", "--set", "limits={}")
    assert main(["sim", "steady", *short, "--out", str(out), *ALL]) == 0
    return out


# --- MF4 --------------------------------------------------------------------------------------------------------------


def test_mf4_holds_the_signals_of_the_trace(session: Session, replayed: Replayed) -> None:
    trace = session.result.trace
    with MDF(replayed.folder / "signals.mf4") as file:
        for name, unit, column in (
            ("theta_measured", "rad", "theta_measured_rad"),
            ("z_ddot_measured", "m/s^2", "z_ddot_measured_m_s2"),
            ("theta_dot_estimate", "rad/s", "theta_dot_estimate_rad_s"),
        ):
            signal = file.get(name)
            assert signal.unit == unit
            np.testing.assert_allclose(signal.samples, trace[column], rtol=1e-6)
            np.testing.assert_allclose(signal.timestamps, trace["time_s"], atol=1e-9)
        signal = file.get("k_p_estimate")
        assert signal.unit == "N/m"
        at = np.rint(signal.timestamps * 1e3).astype(int)
        assert len(at) == 6000 / 20  # publish_period is 20 ms
        np.testing.assert_allclose(signal.samples, trace["k_p_estimate_N_m"][at], rtol=1e-6)


def test_mf4_says_what_its_signals_are_and_when_they_began(replayed: Replayed) -> None:
    with MDF(replayed.folder / "signals.mf4") as file:
        assert file.header.start_time == START
        for name, message in (("theta_measured", "LEVER_SAMPLE"), ("k_p_sigma", "PILOT_SIGMA")):
            signal = file.get(name)
            field = replayed.dbc.get_message_by_name(message).get_signal_by_name(name.removesuffix("_measured"))
            assert (signal.comment, signal.unit) == (field.comment, field.unit)
            assert signal.source is not None
            assert signal.source.name == message
            assert signal.source.bus_type == signal.source.BUS_TYPE_CAN
        names = {channel.name for group in file.groups for channel in group.channels}
        assert {"k_p_recorded", "theta_recorded", "mode_recorded"} <= names


def test_mode_and_faults_are_words_in_mf4(replayed: Replayed) -> None:
    modes = replayed.dbc.get_message_by_name("HEALTH").get_signal_by_name("mode").choices
    health = replayed.frames("HEALTH")
    with MDF(replayed.folder / "signals.mf4") as file:
        mode, faults = file.get("mode"), file.get("faults")
        numbers = file.get("mode", raw=True).samples
    assert [text.decode() for text in mode.samples] == [modes[int(number)] for number in numbers]
    assert {b"align", b"run"} <= set(mode.samples)
    last = {name.removeprefix("fault_") for name, bit in health[-1][1].items() if name.startswith("fault_") and bit}
    assert set(faults.samples[-1].decode().split(", ")) == (last or {"none"})
    assert b"settling" in set(faults.samples)


def test_a_mode_that_is_not_known_yet_is_said_so_in_mf4(session: Session, tmp_path: Path) -> None:
    health = [line for line in session.lines if " 214#" in line]
    late = tmp_path / "late.log"
    late.write_text("\n".join(line for line in session.lines if line not in health[: len(health) // 2]) + "\n")
    assert main(["replay", str(late), "-o", str(tmp_path / "out"), "--format", "mf4"]) == 0
    with MDF(tmp_path / "out/signals.mf4") as file:
        modes = file.get("mode_recorded").samples
    assert (modes[0], modes[-1]) == (b"not known", b"run")


def test_mf4_of_a_simulation_has_the_truth_and_no_date(simulation: Path) -> None:
    table = pd.read_csv(simulation / "trace.csv")
    with MDF(simulation / "signals.mf4") as file:
        assert file.header.start_time == EPOCH
        signal = file.get("m_p_true")
        assert signal.unit == "kg"
        assert signal.source is not None
        assert signal.source.bus_type == signal.source.BUS_TYPE_NONE
        np.testing.assert_allclose(signal.samples, table["m_p_true_kg"], rtol=1e-6)


def test_mf4_has_a_group_for_each_rate_and_says_who_made_it(replayed: Replayed, simulation: Path) -> None:
    groups = []
    for path in (replayed.folder, simulation):
        with MDF(path / "signals.mf4") as file:
            every: Any = file.groups
            groups.append({group.channel_group.acq_name: [each.name for each in group.channels] for group in every})
            history = ElementTree.fromstring(file.file_history[0].comment)
            truth = file.get("m_p_true").source if path is simulation else None
    of_replay, of_simulation = groups
    assert list(of_replay) == ["samples", "estimates", "recorded estimates"]
    assert set(of_simulation) == {"samples", "estimates", "truth"}
    assert {"theta_measured", "theta_recorded", "dither"} <= set(of_replay["samples"])
    assert {"m_p_estimate", "mode", "lost"} <= set(of_replay["estimates"])
    assert "m_p_recorded" in of_replay["recorded estimates"]
    assert all(name.endswith("_true") for name in of_simulation["truth"][1:])
    assert truth is not None
    assert (truth.name, truth.path, truth.source_type) == ("truth", "simulation", truth.SOURCE_TOOL)
    said = {each.tag: each.text for each in history}
    assert (said["tool_id"], said["tool_vendor"]) == ("lever", "Lever CDKF")
    assert said["tool_version"]
    assert said["TX"]


# --- MCAP -------------------------------------------------------------------------------------------------------------


Messages = tuple[dict[str, list[tuple[int, dict[str, Any]]]], dict[str, dict[str, Any]]]


def messages(path: Path) -> Messages:
    """Log time [ns] and content of all messages, and the schema, by topic."""
    content, schemas = defaultdict(list), {}
    with path.open("rb") as file:
        for schema, channel, message in make_reader(file, validate_crcs=True).iter_messages():
            assert schema is not None
            assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
            schemas[channel.topic] = json.loads(schema.data)
            content[channel.topic].append((message.log_time, json.loads(message.data)))
    return content, schemas


@pytest.fixture(scope="module")
def of_replay(replayed: Replayed) -> Messages:
    return messages(replayed.folder / "signals.mcap")


def test_mcap_holds_the_frames_of_the_log_at_their_time(replayed: Replayed, of_replay: Messages) -> None:
    content, _ = of_replay
    for name, fields in (("LEVER_SAMPLE", ("theta", "theta_dot", "tau_m")), ("BASE_SAMPLE", ("z_ddot",))):
        expected = replayed.frames(name)
        found = content[f"/lever/{name}"]
        assert len(found) == len(expected) == 6000
        for (at, message), (time, signals) in zip(found[::97], expected[::97], strict=True):
            assert abs(at - 1000 * time) <= 1000
            assert message == pytest.approx({field: signals[field] for field in fields}, abs=1e-9)
    state = [(at, message) for at, message in replayed.frames("STATE_ESTIMATE") if message["valid"]]
    assert [message["theta"] for _, message in content["/lever/STATE_ESTIMATE"]] == pytest.approx(
        [message["theta"] for _, message in state], abs=1e-9
    )
    assert content["/lever/recorded/STATE_ESTIMATE"] == content["/lever/STATE_ESTIMATE"]


def test_every_message_in_mcap_is_what_its_schema_says(of_replay: Messages, simulation: Path) -> None:
    kinds: dict[str, Any] = {"number": (int, float), "string": str}
    for content, schemas in (of_replay, messages(simulation / "signals.mcap")):
        for topic, schema in schemas.items():
            assert schema["type"] == "object"
            for _, message in content[topic]:
                assert message
                for field, value in message.items():
                    assert isinstance(value, kinds[schema["properties"][field]["type"]]), (topic, field)
    assert schemas["/lever/PILOT_PARAMETERS"]["properties"]["k_p"]["description"].endswith("[N/m]")
    assert content["/lever/truth"][-1][1]["m_p"] == pytest.approx(3.2)


def test_mcap_is_in_order_of_time_with_words_for_mode_and_faults(replayed: Replayed, of_replay: Messages) -> None:
    with (replayed.folder / "signals.mcap").open("rb") as file:
        times = [message.log_time for _, _, message in make_reader(file).iter_messages(log_time_order=False)]
    assert times == sorted(times)
    health = [contents for _, contents in of_replay[0]["/lever/HEALTH"]]
    assert {"align", "run"} <= {contents["mode"] for contents in health}
    assert "settling" in {contents["faults"] for contents in health}


def test_mcap_says_what_its_channels_are(replayed: Replayed) -> None:
    with (replayed.folder / "signals.mcap").open("rb") as stream:
        reader = make_reader(stream)
        library = reader.get_header().library
        summary = reader.get_summary()
    assert library.startswith("lever-cdkf ")
    assert summary is not None
    names = {schema.name: json.loads(schema.data) for schema in summary.schemas.values()}
    assert {channel.topic for channel in summary.channels.values()} == {f"/{name}" for name in names}
    for name, schema in names.items():
        assert name == f"lever/{schema['title']}"
        message = replayed.dbc.get_message_by_name(schema["title"].removeprefix("recorded/"))
        assert schema["description"] == (message.comment or "")
        assert schema["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    theta = names["lever/LEVER_SAMPLE"]["properties"]["theta"]
    assert theta == {"type": "number", "description": "Lever angle from the floor. [rad]"}
    assert names["lever/HEALTH"]["properties"]["mode"]["type"] == "string"


# --- Parquet ----------------------------------------------------------------------------------------------------------


def test_parquet_holds_the_columns_of_the_trace(replayed: Replayed) -> None:
    table = pl.read_parquet(replayed.folder / "trace.parquet")
    assert table.columns == list(replayed.table.columns)
    for name in table.columns:
        if table[name].dtype != pl.String:
            found = table[name].cast(pl.Float64).to_numpy()
            np.testing.assert_allclose(found, replayed.table[name], atol=0.51e-6, err_msg=name)
    assert table["theta_estimate_rad"].null_count() > 0
    assert table["lost"].dtype == pl.Int64
    assert set(table["mode"].unique()) >= {"align", "run"}
    assert set(table["faults"].drop_nulls().unique()) >= {"", "settling"}


def test_parquet_says_the_unit_of_each_column(replayed: Replayed) -> None:
    schema = parquet.read_schema(replayed.folder / "trace.parquet")
    for column, unit in (("time_s", b"s"), ("k_p_sigma_N_m", b"N/m"), ("theta_recorded_rad", b"rad"), ("mode", b"")):
        assert schema.field(column).metadata[b"unit"] == unit
    assert schema.field("theta_measured_rad").metadata[b"comment"] == b"Lever angle from the floor."
    assert schema.metadata[b"start"].decode() == START.isoformat()


# --- provenance -------------------------------------------------------------------------------------------------------


def test_every_file_says_where_it_is_from(replayed: Replayed) -> None:
    folder = replayed.folder
    summary = json.loads((folder / "summary.json").read_text())
    origin = summary["provenance"]
    assert origin["inputs"] == {str(replayed.log): digest(replayed.log)}
    assert origin["outputs"] == {name: digest(folder / name) for name in ("bus.log", "trace.csv")}
    assert origin["created"] == "2023-11-14T22:13:20Z"
    with MDF(folder / "signals.mf4") as file:
        mf4 = {e.attrib["name"]: e.text or "" for e in ElementTree.fromstring(file.header.comment).iter("e")}
        assert file.file_history[0].time_stamp == datetime.fromtimestamp(1_700_000_000, tz=timezone.utc)
    with (folder / "signals.mcap").open("rb") as stream:
        (record,) = make_reader(stream).iter_metadata()
    columns = {
        key.decode(): text.decode() for key, text in parquet.read_schema(folder / "trace.parquet").metadata.items()
    }
    columns.pop("ARROW:schema", None)
    assert record.name == "provenance"
    assert mf4 == record.metadata == columns
    assert json.loads(mf4["estimator"]) == summary["estimator"]
    assert json.loads(mf4["inputs"]) == origin["inputs"]
    for name in ("version", "library", "created", "command"):
        assert mf4[name] == origin[name] != ""


def digest(path: Path) -> str:
    return f"sha256:{hashlib.sha256(path.read_bytes()).hexdigest()}"


# --- the option -------------------------------------------------------------------------------------------------------


def test_only_what_is_asked_for_is_written(session: Session, tmp_path: Path) -> None:
    for formats, files in (("parquet", {"trace.parquet"}), ("mcap,csv", {"signals.mcap", "trace.csv"})):
        log = (str(session.log), "--length", "1")
        assert main(["replay", *log, "-o", str(tmp_path), "--format", formats]) == 0
        assert {path.name for path in tmp_path.iterdir()} == {"bus.log", "report.html", "summary.json", *files}


def test_what_is_wrong_with_formats_is_one_line(session: Session, refused: Refused, tmp_path: Path) -> None:
    assert "'xls' is none of csv, mf4, mcap, parquet" in refused(
        "replay", session.log, "-o", tmp_path, "--format", "xls"
    )
    assert "--format is for the files of --out" in refused("sim", "steady", "--format", "mf4")
    assert "--format is for a single run" in refused("sim", "steady", "--seeds", "2", "--format", "mf4")


def test_an_input_is_not_written_over(replayed: Replayed, refused: Refused, tmp_path: Path) -> None:
    for name in ("trace.parquet", "signals.mf4"):
        shutil.copy(replayed.folder / name, tmp_path)
        before = (tmp_path / name).read_bytes()
        assert "it is an input" in refused("replay", tmp_path / name, "-o", tmp_path, *ALL)
        assert (tmp_path / name).read_bytes() == before


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # of the file that cannot be closed
@pytest.mark.parametrize("name", FORMATS)
def test_a_full_disk_is_an_error_that_names_the_file(name: str, tmp_path: Path) -> None:
    count = 50_000
    time = np.linspace(0.0, 50.0, count)
    trace: Trace = {"time_s": time, "theta_measured_rad": np.random.default_rng(1).random(count)}
    rows = np.ones(count, np.bool_)

    def write() -> None:
        with SignalFiles([name], tmp_path.joinpath, provenance()) as files:
            files.start(trace, 0, {"model": "lever"})
            files.add(trace, rows, rows)
            files.close()

    with full_disk(100_000), pytest.raises(LeverError, match=f"cannot write .*{FORMATS[name]}"):
        write()


def test_another_model_has_its_own_columns(tmp_path: Path) -> None:
    session = simulated("linear_black_box", tmp_path / "sim", "duration=2 s", "converged_after=1 s")
    assert main(["replay", str(session.log), "-o", str(tmp_path / "out"), "--model", "linear_black_box", *ALL]) == 0
    with MDF(tmp_path / "out/signals.mf4") as file:
        assert file.get("a21_estimate").unit == "1/s^2"
    assert parquet.read_schema(tmp_path / "out/trace.parquet").field("a22_sigma_1_s").metadata[b"unit"] == b"1/s"
