"""What the views say of frames that are made here: each row of the health, each column of a table, each cell."""

from __future__ import annotations

import json
import math
from collections import Counter
from pathlib import Path

import pytest
from lever_cdkf.can import codec
from lever_cdkf.firmware.config import Config
from lever_cdkf.firmware.library import enum_names, enum_words
from lever_cdkf.watch import panels, status
from lever_cdkf.watch.picture import Frame, Picture
from lever_cdkf.watch.sources import Source
from lever_cdkf.watch.state import State
from python.conftest import Run, Session
from python.watch.test_panels import Quiet, rows


class Bus:
    """An estimator that says what it is told to say."""

    def __init__(self) -> None:
        self.picture = Picture()
        self._counters: Counter[str] = Counter()

    def frame(self, name: str, values: dict[str, codec.Value]) -> Frame:
        """Return a frame; fields that are not given are 0."""
        message = codec.message(name)
        fields = {each.name: 0 for each in message.signals if each.multiplexer_ids is None}
        for wanted in ("crc", "counter"):
            fields.pop(wanted)
        fields = {key: value for key, value in fields.items() if not key.endswith("_valid")}
        self._counters[name] += 1
        return message.frame_id, codec.encode(name, self._counters[name] - 1, {**fields, **values})

    def say(self, now: float, **messages: dict[str, codec.Value]) -> None:
        self.picture.take([self.frame(name, values) for name, values in messages.items()], now)


STATE: dict[str, codec.Value] = {"valid": 1, "theta": 0.35, "theta_dot": 0.0, "innovation": 2.5}
HEALTH: dict[str, codec.Value] = {"mode": "run", "excitation": 0.123}


def facts(bus: Bus) -> dict[str, tuple[str, str]]:
    return {name: (text, level) for name, text, level in status.facts(bus.picture, Quiet())}


def test_an_estimator_that_says_nothing_has_a_dash_in_each_row() -> None:
    assert facts(Bus()) == {
        "mode": ("–", ""),
        "choices": ("–", ""),
        "counts": ("0 lost, 0 corrupt, 0 late", ""),
        "excitation": ("– rad/s", ""),
        "dither": ("off", ""),
        "mean NIS": ("– (expected 2)", ""),
        "theta": ("– deg", ""),
        "faults": ("–", ""),
    }


def test_each_row_of_the_health_says_what_the_frames_say() -> None:
    bus = Bus()
    choices: dict[str, codec.Value] = {
        "page": 2, "model": "lever", "preload": "trim", "estimator": "joint", "adaptation": "forgetting",
        "mitigation": "notch", "dither_rms": 0.25,
    }  # fmt: skip
    for now, count in ((0.1, 0), (0.2, 5)):
        bus.say(
            now,
            STATE_ESTIMATE=STATE,
            HEALTH={**HEALTH, "restarts": count},
            LINK_HEALTH={"valid": 1, "lost": 3 * count, "corrupt": 2 * count, "late": count},
            MOTOR_COMMAND={"valid": 1, "torque": 0.0, "dither": 0.2},
            PLATFORM_HEALTH={
                "valid": 1,
                "transmit_errors": 7,
                "receive_errors": 9,
                "bus_offs": count,
                "overruns": 4 * count,
                "dropped": 6 * count,
            },
            IDENTITY=choices,
            STABILITY={"valid": 1, "bounce": "warning", "gain_margin": 4.5, "gain_margin_sigma": 0.8, "frequency": 3.3},
            PLATFORM_RESET={"cause": "power_on"},
        )
    theta = f"{math.degrees(0.35):.2f} deg"
    assert facts(bus) == {
        "mode": ("run", ""),
        "choices": ("trim, joint, forgetting, notch", ""),
        "counts": ("15 lost, 10 corrupt, 5 late", ""),
        "excitation": ("0.12 rad/s", ""),
        "dither": ("0.200 N m rms, asked 0.25", ""),
        "mean NIS": (f"{facts(bus)['mean NIS'][0].split()[0]} (expected 2)", ""),
        "bounce": ("warning: gain margin 4.5 ± 0.8 dB at 3.3 Hz", "watch"),
        "theta": (theta, ""),
        "TEC, REC": ("7, 9; off bus 5", ""),
        "machine": ("20 lost, 30 dropped", ""),
        "last reset": ("power on, 0 since power-on", ""),
        "faults": ("none", "good"),
        "restarts": ("5", ""),
    }
    mean_nis = float(facts(bus)["mean NIS"][0].split()[0])
    assert mean_nis == pytest.approx(2.5**2, rel=0.01)  # the field is its square root


@pytest.mark.parametrize(
    ("bounce", "level"), [("unknown", "good"), ("clear", "good"), ("warning", "watch"), ("alarm", "bad")]
)
def test_the_state_of_bounce_has_a_level_and_says_when_nothing_is_known_of_it(bounce: str, level: str) -> None:
    bus = Bus()
    stable: dict[str, codec.Value] = {"bounce": bounce, "gain_margin": 9.0, "gain_margin_sigma": 1.2}
    bus.say(0.1, STATE_ESTIMATE=STATE, HEALTH=HEALTH, STABILITY={**stable, "valid": 1, "frequency": None})
    assert status.bounce(bus.picture) == (level, f"{bounce}: gain margin 9.0 ± 1.2 dB")
    bus.say(0.2, STABILITY={**stable, "valid": 1, "frequency": 2.0, "gain_margin": None})
    assert status.bounce(bus.picture) == (level, f"{bounce}: the margin is not known")
    said = status.condition(bus.picture)
    assert said == (
        (level, f"collective bounce, {bounce}: the margin is not known")
        if level != "good"
        else ("good", f"run: {enum_words('lever_mode')['run']}")
    )


@pytest.mark.parametrize("mode", enum_names("lever_mode").values())
def test_each_mode_has_its_words_and_level(mode: str) -> None:
    bus = Bus()
    bus.say(0.1, STATE_ESTIMATE=STATE, HEALTH={**HEALTH, "mode": mode})
    level = {"run": "good", "fault": "bad"}.get(mode, "watch")
    assert status.condition(bus.picture) == (level, f"{mode}: {enum_words('lever_mode')[mode]}")
    bus.say(0.2, HEALTH={**HEALTH, "mode": mode, "fault_gap": 1, "fault_base": 1})
    level, text = status.condition(bus.picture)
    assert (level == "watch" and text.startswith("run, but: ")) is (mode == "run")
    words = [enum_words("lever_fault")[name] for name in ("base", "gap")]
    assert facts(bus)["faults"] == ("; ".join(words), "watch")


def test_of_calibration_the_evidence_is_named_where_it_is_sent() -> None:
    bus, words = Bus(), enum_words("lever_fault")["calibration"]
    bus.say(0.1, STATE_ESTIMATE=STATE, HEALTH={**HEALTH, "fault_calibration": 1})
    assert facts(bus)["faults"][0] == f"{words} (set publish_test_ratios=1 to see the evidence)"
    bus.say(0.2, TEST_RATIO={"evidence": "noise", "ratio": 1.5, "verdict": 0, "present": 1})
    assert facts(bus)["faults"][0] == words
    bus.say(0.3, TEST_RATIO={"evidence": "clock", "ratio": 1.5, "verdict": 0, "present": 1})
    step = "check the time of the samples, and sample_period"
    assert facts(bus)["faults"][0] == f"{words} ({step}; evidence: clock)"


def test_the_condition_before_there_is_a_mode() -> None:
    bus = Bus()
    assert status.condition(bus.picture) == ("watch", "no frame has come yet")
    bus.picture.take([(0x7AB, b"")], 0.1)
    assert status.condition(bus.picture) == ("watch", "frames pass, but neither samples nor estimates")
    bus.say(0.2, BASE_SAMPLE={"z_ddot": 0.0})
    assert status.condition(bus.picture) == (
        "bad", "samples pass, but no estimator answers: is the firmware running?",
    )  # fmt: skip
    bus.say(0.3, STATE_ESTIMATE=STATE)
    assert status.condition(bus.picture) == ("watch", "the estimator is there; no HEALTH from it yet")
    bus.picture.take([], 1.3)
    assert status.condition(bus.picture)[0] == "watch"
    bus.picture.take([], 1.4)
    assert status.condition(bus.picture) == ("bad", "no frame from the estimator for 1 s: what is shown is old")


PARAMETERS: dict[str, codec.Value] = {"model": "lever", "valid": 1, "m_p": 2.5, "c_p": 40.0, "k_p": 1600.0}
SIGMA: dict[str, codec.Value] = {
    "model": "lever", "valid": 1, "m_p_sigma": 0.05, "c_p_sigma": 4.0, "k_p_sigma": 80.0
}  # fmt: skip
DYNAMICS: dict[str, codec.Value] = {
    "model": "lever", "valid": 1, "natural_frequency": 1.9, "damping_ratio": 0.3, "natural_frequency_sigma": 0.02,
    "damping_ratio_sigma": 0.03,
}  # fmt: skip


def test_each_cell_of_the_estimates() -> None:
    bus = Bus()
    for k in range(40):
        bus.say(0.1 * k, PILOT_PARAMETERS=PARAMETERS, PILOT_SIGMA=SIGMA, PILOT_DYNAMICS=DYNAMICS, STATE_ESTIMATE=STATE)
    table = panels.estimates(bus.picture, 30.0, 80)
    cells = {name: line[:-1] for name, (line, _) in rows(table).items()}
    assert cells == {
        "": ["estimate", "± σ", "unit", "σ [%]", "30 s [%]"],
        "m_p": ["2.500", "± 0.050", "kg", "2.0", "+0.0 →"],
        "c_p": ["40.00", "± 4.0", "N s/m", "10", "+0.0 →"],
        "k_p": ["1600", "± 80", "N/m", "5.0", "+0.0 →"],
        "natural_frequency": ["1.900", "± 0.020", "Hz", "1.1", "+0.0 →"],
        "damping_ratio": ["0.3000", "± 0.030", "", "10", "+0.0 →"],
    }
    assert rows(table)[""][0][-1] == "trend"
    assert [column.justify for column in table.columns][:6] == ["left", "right", "right", "left", "right", "right"]
    narrow = rows(panels.estimates(bus.picture, 30.0, panels.ESTIMATES_WIDTH))
    assert narrow[""][0][-1] == ""  # no room for a trend


def test_a_chart_of_several_lines_has_its_range_beside_it() -> None:
    bus = Bus()
    for k in range(40):
        parameters = {**PARAMETERS, "k_p": 1500.0 + 10.0 * k}
        bus.say(0.1 * k, PILOT_PARAMETERS=parameters, PILOT_SIGMA=SIGMA, PILOT_DYNAMICS=DYNAMICS)
    k_p = rows(panels.estimates(bus.picture, 60.0, 100, 3))["k_p"][0]
    assert k_p[-1].split("\n") == ["1890", "", "1500"]
    assert k_p[-2].count("\n") == 2
    assert k_p[4].endswith("↗")


def test_each_column_of_the_messages() -> None:
    bus = Bus()
    for k in range(30):
        bus.say(0.1 * k, STATE_ESTIMATE=STATE)
    identifier, data = bus.frame("STATE_ESTIMATE", STATE)
    bus.picture.take([(identifier, bytes([data[0] ^ 1]) + bytes(data[1:]))], 3.0)
    bus.frame("STATE_ESTIMATE", STATE)  # lost
    good = bus.frame("STATE_ESTIMATE", STATE)
    bus.picture.take([good, good], 3.1)
    table = panels.messages(bus.picture)
    said = {name: (cells, colours) for name, (cells, colours) in rows(table).items()}
    assert list(said) == ["message", "LEVER_SAMPLE", "BASE_SAMPLE", "STATE_ESTIMATE", "HEALTH"]
    assert said["message"][0] == ["[1/s]", "lost", "corrupt", "repeated"]
    lost, corrupt, repeated = map(int, said["STATE_ESTIMATE"][0][1:])
    assert (corrupt, repeated) == (1, 1)
    assert lost >= 1
    assert said["STATE_ESTIMATE"][0][0] in ("10", "9", "11")
    assert said["HEALTH"][0] == ["–"] * 4
    assert "dim" in said["HEALTH"][1]
    assert [column.justify for column in table.columns] == ["left", *["right"] * 4]


def test_once_has_four_parts_under_their_names(session: Session, lever: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("COLUMNS", raising=False)
    monkeypatch.chdir(session.folder)
    _, out, _ = lever("monitor", "--once", "bus.log")
    lines = out.splitlines()
    assert [line.rstrip("─") for line in lines if "─" in line] == ["estimates ", "feedthrough ", "health ", "messages "]
    assert {len(line) for line in lines if "─" in line} == {100}
    assert lines[0].startswith("bus.log · model lever · watching for 0:0")
    assert lines[1].startswith("● ")
    assert "30 s [%]" in out
    health = lines[lines.index(next(line for line in lines if line.startswith("health"))) + 1 :]
    assert health[0].split() == ["mode", "run"]
    assert out.rstrip().splitlines()[-1].split()[0] in {each.name for each in codec.database().messages}


@pytest.mark.parametrize(
    ("now", "shown"), [(0.0, "0:00"), (9.0, "0:09"), (59.99, "0:59"), (60.0, "1:00"), (671, "11:11")]
)
def test_the_headline_counts_minutes(now: float, shown: str) -> None:
    picture = Picture()
    picture.take([], now)
    assert panels.headline(picture, Quiet()).plain == f"a test · watching for {shown} min"


class Told(Source):
    """A source whose frames are those of a Bus."""

    title = "told"

    def __init__(self, bus: Bus) -> None:
        super().__init__()
        self.bus, self.time = bus, 0.0

    @property
    def now(self) -> float:
        return self.time

    def run(self) -> None:
        """Nothing comes by itself."""

    def say(self, now: float, **messages: dict[str, codec.Value]) -> None:
        self.time = now
        for name, values in messages.items():
            self._put(self.bus.frame(name, values))


def test_an_update_of_the_page_says_what_the_frames_say() -> None:
    source = Told(Bus())
    state = State(source, Config())
    start = json.loads(state.start())["start"]
    assert (start["title"], start["model"], start["controls"], start["rows"]) == ("told", None, False, [])
    assert [q["key"] for q in start["quantities"]] == ["natural_frequency", "damping_ratio"]
    for k in range(12):
        source.say(
            0.1 * k,
            PILOT_PARAMETERS=PARAMETERS,
            PILOT_SIGMA=SIGMA,
            PILOT_DYNAMICS=DYNAMICS,
            STATE_ESTIMATE=STATE,
            HEALTH=HEALTH,
            MOTOR_COMMAND={"valid": 1, "torque": 0.0, "dither": 0.2},
            IDENTITY={
                "page": 0,
                "firmware_major": 1,
                "firmware_minor": 2,
                "firmware_patch": 3,
                "contract": codec.contract(),
            },
        )
        messages = state.advance()
    update = json.loads(messages[-1])["update"]
    assert (update["level"], update["mode"], update["run"]) == ("good", "run", 1)
    assert update["condition"] == f"run: {enum_words('lever_mode')['run']}"
    assert update["silence"] == 0.0
    assert update["truth"] is update["truth_phase"] is None
    row = update["row"]
    assert row[0] == 1.1
    assert row[1:16:3] == [2.5, 40.0, 1600.0, 1.9, 0.3]  # estimates,
    assert row[2:16:3] == [0.05, 4.0, 80.0, 0.02, 0.03]  # their sigmas,
    assert row[3:16:3] == [None] * 5  # and no truth
    assert row[16:] == [pytest.approx(6.25, rel=0.01), 0.123, 0.2]
    health = {name: text for name, text, _ in update["health"]}
    assert (health["model"], health["firmware"], health["mode"]) == ("–", "1.2.3", "run")
    counts = {name: cells for name, *cells in update["messages"]}
    assert counts["STATE_ESTIMATE"][1:] == [0, 0, 0]
    assert counts["STATE_ESTIMATE"][0] == pytest.approx(10, abs=1)
    assert counts["COMMAND"][0] is None
    start = json.loads(state.start())["start"]
    assert (start["model"], start["without_torque"]) == ("lever", False)
    assert len(start["rows"]) == 12
    assert [at for at, _ in start["map"]] == pytest.approx([0.0, 0.5, 1.0])
    assert len(start["map_frequencies"]) == len(start["map"][-1][1])


def test_a_page_is_told_what_its_axes_are() -> None:
    start = json.loads(State(Told(Bus()), Config()).start())["start"]
    assert (start["span"], start["step"], start["map_step"]) == (60.0, 0.1, 0.5)
    assert start["choices"] == {what: list(enum_names(f"lever_{what}").values()) for what in ("model", "estimator")}
    assert start["others"] == ["nis", "excitation", "dither"]
    assert start["coherence_frequencies"] == [0.5 * k for k in range(1, 25)]
    assert start["map_frequencies"] == start["frequencies"][::2]
    assert start["dither_limit"] == min(Config().settings[name] for name in ("torque_rms", "torque_limit"))
    assert start["simulated"] is False


def test_a_log_that_is_read_at_once_says_what_it_is(tmp_path: Path, lever: Run) -> None:
    log = tmp_path / "short.log"
    log.write_text("(1.000000) can0 123#00\n")
    assert "● frames pass, but neither samples nor estimates" in lever("monitor", "--once", log)[1]


@pytest.mark.parametrize(
    ("failed", "words"),
    [(1, "program memory"), (2, "RAM"), (4, "stack"), (8, "golden vector"), (16, "settings or aircraft of its build")],
)
def test_each_self_test_has_its_words(failed: int, words: str) -> None:
    bus = Bus()
    bus.say(0.1, PLATFORM_RESET={"cause": "power_on", "failed": failed})
    assert status.last_reset(bus.picture) == f"power on, 0 since power-on; failed: {words}"


@pytest.mark.parametrize(("age", "is_shown"), [(1.99, True), (2.01, False)])
def test_what_is_older_than_two_seconds_is_not_shown(age: float, is_shown: bool) -> None:
    bus = Bus()
    bus.say(1.0, STATE_ESTIMATE=STATE, HEALTH=HEALTH, STABILITY={"valid": 1, "bounce": "clear"})
    bus.picture.take([], 1.0 + age)
    assert (facts(bus)["mode"][0] == "run") is is_shown
    assert (status.bounce(bus.picture) is not None) is is_shown
    assert (not math.isnan(bus.picture.nis())) is is_shown
