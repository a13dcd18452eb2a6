"""Which signal of a log or file is which input of the firmware, and what turns the one into the other.

    theta=LEVER_POSITION.Angle                              what the database or the header says, gravity by its looks
    z_ddot=IMU.AccZ,unit=g,sign=-1,gravity=included         said by hand
    theta=Angle,factor=0.0017,offset=-2 deg,channel=can1,delay=4 ms
    time=Stamp,unit=ms                                      the column of time of a file

or the same as TOML, a table for each input, and one for each message with E2E protection:

    [theta]
    message = "LEVER_POSITION"
    signal = "Angle"

    [protected.LEVER_POSITION]
    profile = 1
    data_id = 0x1A2
    counter = "AngleCounter"
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from ..errors import LeverError
from ..text.suggestions import did_you_mean
from ..text.toml_text import TomlError, parse
from ..text.units import split
from .units import INPUTS, KINDS, factor

GRAVITY_CHOICES = ("auto", "included", "none")
PROTECTED = "protected"


@dataclass(frozen=True)
class Source:
    """Where one input comes from."""

    signal: str
    """MESSAGE.SIGNAL of a database, SIGNAL where only one message has it, or a column of a file."""
    unit: str = ""
    """Of the recorded values; empty: what the database or header says, else by plausibility."""
    factor: float | None = None
    """Instead of a unit: value times this, plus offset, is in the firmware's unit."""
    offset: float = 0.0
    """Added to the values [the firmware's unit]."""
    sign: int | None = None
    """1 or -1; None: 1, but -1 for an acceleration whose gravity points down."""
    gravity: str = "auto"
    """Whether an acceleration holds gravity: included, none, or auto, by its median."""
    channel: str | None = None
    """The bus; by default the only one that has the message."""
    delay: float = 0.0
    """Delay [s], subtracted from its times; negative for a signal that is ahead of the others."""


@dataclass(frozen=True)
class Protection:
    """How a message is protected against losses and damage (AUTOSAR E2E)."""

    profile: int | None = None
    """1, 2 or 5; None: the counter alone."""
    data_id: int | tuple[int, ...] = 0
    """The identifier; of profile 2 the list of sixteen."""
    counter: str | None = None
    """The signal that counts frames; losses are counted by it, repeated frames dropped."""


@dataclass(frozen=True)
class Mapping:
    """All inputs that there are, and how to read what they come from."""

    sources: dict[str, Source]
    protected: dict[str, Protection] = field(default_factory=dict)
    time: str | None = None
    """The column with the time, of a file without a bus; by default found by its name."""
    time_unit: str = ""
    """Of that column; empty: what the header says, else by its steps."""

    def __post_init__(self) -> None:
        if "theta" not in self.sources and "theta_dot" not in self.sources:
            raise LeverError("the mapping has neither theta nor theta_dot: give --map theta=MESSAGE.SIGNAL")
        if "z_ddot" not in self.sources:
            raise LeverError(
                "the mapping has no z_ddot, the acceleration of the base: give --map z_ddot=MESSAGE.SIGNAL"
            )


def read_mapping(entries: Iterable[str]) -> Mapping:
    """Return a mapping of KEY=SIGNAL[,OPTION=VALUE…] and of .toml files, later ones over earlier ones.

    Raise LeverError.
    """
    sources: dict[str, Source] = {}
    protected: dict[str, Protection] = {}
    time: tuple[str, str] | None = None
    for entry in entries:
        if "=" not in entry or (entry.lower().endswith(".toml") and Path(entry).is_file()):
            content = _toml(entry)
            tables = content.pop(PROTECTED, {})
            if not isinstance(tables, dict):
                raise LeverError(f"--map {entry}: {PROTECTED} is a table of messages, as in [{PROTECTED}.MESSAGE]")
            protected |= {name: _protection(name, each) for name, each in tables.items()}
            time = _time(content.pop("time", None)) or time
            sources |= {_key(key): _source(key, table) for key, table in content.items()}
            continue
        key, _, text = entry.partition("=")
        if key.strip() == "time":
            time = time_column(text)
        else:
            sources[_key(key)] = _source(key, _assignments(key, text))
    return Mapping(sources, protected, *(time or ()))


def time_column(text: str) -> tuple[str, str]:
    """Return name and unit of a column of time, COLUMN[,unit=UNIT]; the unit is empty without one. Raise LeverError."""
    found = _time(_assignments("time", text))
    assert found is not None
    return found


def as_toml(mapping: Mapping) -> str:
    """Return the text of a mapping file."""
    lines: list[str] = []
    if mapping.time is not None:
        unit = [f"unit = {_quoted(mapping.time_unit)}"] if mapping.time_unit else []
        lines = ["[time]", f"signal = {_quoted(mapping.time)}", *unit, ""]
    for key, source in mapping.sources.items():
        lines += [f"[{key}]", f"signal = {_quoted(source.signal)}"]
        for each in fields(Source)[1:]:
            value = getattr(source, each.name)
            if value != each.default:
                lines.append(f"{each.name} = {_quoted(value) if isinstance(value, str) else value}")
        lines.append("")
    for message, protection in mapping.protected.items():
        lines.append(f"[{PROTECTED}.{_quoted(message)}]")
        lines += [] if protection.profile is None else [f"profile = {protection.profile}"]
        identifier = protection.data_id
        lines.append(f"data_id = {identifier if isinstance(identifier, int) else list(identifier)}")
        lines += [] if protection.counter is None else [f"counter = {_quoted(protection.counter)}"]
        lines.append("")
    return "\n".join(lines)


def _quoted(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'


# --- from text -------------------------------------------------------------------------------------------------------


def _toml(path: str) -> dict[str, Any]:
    if not path.lower().endswith(".toml"):
        raise LeverError(f"--map {path}: it is neither KEY=MESSAGE.SIGNAL nor a .toml file")
    try:
        return parse(Path(path).read_bytes())
    except OSError as error:
        raise LeverError(f"cannot read {path}: {error.strerror}") from None
    except TomlError as error:
        raise LeverError(f"{path}: {error}") from None


def _time(table: Any) -> tuple[str, str] | None:
    """Return column and unit of a mapping's time."""
    if table is None:
        return None
    table = table if isinstance(table, dict) else {"signal": table}
    name, unit = table.get("signal"), table.get("unit", "")
    if not isinstance(name, str) or not isinstance(unit, str):
        raise LeverError('mapping of time: it needs a column, as in time = "t"')
    if unknown := sorted(set(table) - {"signal", "unit"}):
        raise LeverError(f"mapping of time: it may have a unit, and not {', '.join(unknown)}")
    if unit and factor("time", unit) is None:
        raise LeverError(f"mapping of time: {unit} is no unit of time known here: s, ms, us, ns")
    return name, unit


def _key(key: str) -> str:
    key = key.strip()
    if key not in INPUTS:
        hint = did_you_mean(key, INPUTS, "no such input;")
        raise LeverError(
            f"--map {key}: {hint} the inputs are {', '.join(INPUTS)}, and time for a file's column of time"
        )
    return key


def _assignments(key: str, text: str) -> dict[str, Any]:
    """SIGNAL,unit=deg,sign=-1 as a table; a comma that no option follows belongs to the name."""
    names = [each.name for each in fields(Source)]
    parts = text.split(",")
    options: dict[str, Any] = {}
    while len(parts) > 1 and parts[-1].partition("=")[0].strip() in names:
        name, _, value = parts.pop().partition("=")
        options[name.strip()] = value.strip()
    signal = ",".join(parts).strip()
    if not signal:
        raise LeverError(f"--map {key}=: the signal is missing: give MESSAGE.SIGNAL, or the column of a file")
    return {"signal": signal, **options}


def _source(key: str, table: Any) -> Source:
    where = f"mapping of {key.strip()}"
    if not isinstance(table, dict) or "signal" not in table:
        raise LeverError(f'{where}: it needs a signal, as in [{key.strip()}] signal = "Angle"')
    table = dict(table)
    if message := table.pop("message", None):
        table["signal"] = f"{message}.{table['signal']}"
    names = [each.name for each in fields(Source)]
    if unknown := sorted(set(table) - set(names)):
        raise LeverError(f"{where}: unknown {', '.join(unknown)}; it may have message, {', '.join(names)}")
    for name, kind in (("factor", None), ("offset", key.strip()), ("delay", "time")):
        if name in table:
            table[name] = _quantity(where, name, table[name], kind)
    if "sign" in table:
        if str(table["sign"]).strip() not in ("1", "+1", "-1"):
            raise LeverError(f"{where}: sign = {table['sign']}; it may be 1 or -1")
        table["sign"] = int(table["sign"])
    table |= {name: str(table[name]) for name in ("signal", "unit", "gravity", "channel") if name in table}
    source = Source(**table)
    _check(where, key.strip(), source)
    return source


def _check(where: str, key: str, source: Source) -> None:
    if source.gravity not in GRAVITY_CHOICES:
        raise LeverError(f"{where}: gravity = {source.gravity}; it may be {', '.join(GRAVITY_CHOICES)}")
    if source.gravity != "auto" and key != "z_ddot":
        raise LeverError(f"{where}: gravity is of z_ddot alone")
    if source.unit and source.factor is not None:
        raise LeverError(f"{where}: a unit and a factor: give one of them")
    if source.unit and factor(key, source.unit) is None:
        what, si = KINDS[key]
        raise LeverError(f"{where}: {source.unit} is no unit of {what} known here: give factor=, to {si}")
    if abs(source.delay) > 1.0:
        raise LeverError(f"{where}: delay = {source.delay:g} s is more than a second: it is in seconds")


def _quantity(where: str, name: str, value: Any, kind: str | None) -> float:
    """Return a number, or one with a unit of KINDS[kind], in SI. Raise LeverError."""
    number, unit = split(str(value)) or ("nan", "")
    scale = 1.0 if not unit else None if kind is None else factor(kind, unit)
    if scale is None or not math.isfinite(float(number)) or isinstance(value, bool):
        what = "" if kind is None else f", in {KINDS[kind][1]} or with a unit of {KINDS[kind][0]}"
        raise LeverError(f"{where}: {name} = {value}; it must be a number{what}")
    return float(number) * scale


def _protection(name: str, table: Any) -> Protection:
    where = f"mapping of [{PROTECTED}.{name}]"
    if not isinstance(table, dict) or (unknown := sorted(set(table) - {each.name for each in fields(Protection)})):
        raise LeverError(
            f"{where}: it may have profile, data_id and counter"
            + (f", not {', '.join(unknown)}" if isinstance(table, dict) else "")
        )
    given = dict(table)
    if isinstance(given.get("data_id"), list):
        given["data_id"] = tuple(given["data_id"])
    ids = given.get("data_id", 0)
    if not all(type(each) is int for each in (ids if isinstance(ids, tuple) else (ids, given.get("profile", 1)))):
        raise LeverError(f"{where}: profile and data_id are whole numbers")
    if not isinstance(given.get("counter", ""), str):
        raise LeverError(f"{where}: counter is the name of a signal")
    protection = Protection(**given)
    if protection.profile is None and protection.counter is None:
        raise LeverError(f"{where}: it has neither a profile nor a counter")
    if protection.profile not in (None, 1, 2, 5):
        raise LeverError(f"{where}: profile = {protection.profile}; it may be 1, 2 or 5")
    most, count = (255, 16) if protection.profile == 2 else (65535, 1)
    each = ids if isinstance(ids, tuple) else (ids,)
    if isinstance(ids, tuple) != (count > 1) or len(each) != count or not all(0 <= one <= most for one in each):
        raise LeverError(
            f"{where}: data_id is a list of sixteen bytes for profile 2, and a number from 0 to 65535 for the others"
        )
    return protection
