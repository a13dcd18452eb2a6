"""summary.json as values: what a simulation, or a replay, comes to. None stands for what there is nothing to say of."""

from __future__ import annotations

import dataclasses
import json
import types
import typing
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from ..errors import LeverError
from ..runtime.files import json_text
from ..runtime.provenance import Provenance
from .nis import Nis
from .whiteness import Whiteness

SCHEMA = 1
"""Goes up when a field changes its meaning, its name or its place, or goes."""

_Content = TypeVar("_Content")


@dataclass(frozen=True)
class Estimator:
    """Its choices and settings."""

    model: str
    preload: str
    estimator: str
    adaptation: str
    mitigation: str
    settings: dict[str, float]


@dataclass(frozen=True)
class Stability:
    """How near collective bounce was, with an aircraft."""

    states_s: dict[str, float]
    """Seconds in each state of enum lever_bounce."""
    least_margin_db: float | None
    its_sigma_db: float | None
    at_s: float | None
    warning_db: float
    """Limits of the gain margin."""
    alarm_db: float
    greatest_correction_rad: float | None = None
    """Of the lever's angle, by mitigation; None without."""
    aircraft: str = ""
    """Which, with its gearing, or its file."""
    least_true_margin_db: float | None = None
    """Of the simulated pilot; below 0 the loop is unstable."""
    unstable_s: float | None = None
    """Seconds for which it is."""


@dataclass(frozen=True, kw_only=True)
class Summary:
    """What both have."""

    schema: int = SCHEMA
    estimator: Estimator
    samples: int
    lost: int
    corrupt: int
    late: int
    restarts: int
    nis: Nis
    whiteness: Whiteness | None
    modes_s: dict[str, float]
    """Seconds in each mode."""
    fault_shares: dict[str, float]
    """Shares (0 to 1) of the judged time with each fault that there was; without those of inputs that a log lacks.

    Of a replay: of all time where flagged_share is None.
    """
    flagged_share: float | None
    """Of the judged time with any of DO_NOT_TRUST of those; None where nothing is judged."""
    passed: bool
    verdict: str
    """In a few sentences."""
    warning: str = ""
    """What the estimator says against its estimates for a part of the time that counts, and what to do next: the first
    thing to read. Empty where it says nothing."""
    stability: Stability | None = None
    """None without an aircraft."""
    provenance: Provenance | None = None
    """Of the files of the run; None where there are none."""


# --- of a simulation -------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Scenario:
    """What was run."""

    name: str
    title: str
    description: str
    seed: int
    sample_period_s: float
    converged_after_s: float
    changes_s: list[float]
    """After which the parameters have to be found anew: the start, and every jump."""
    limits: dict[str, float]


@dataclass(frozen=True)
class TrueTransfer:
    """theta/z_ddot of the truth: polynomials of s, highest power first, from each of `time_s` on."""

    time_s: list[float]
    numerator: list[list[float]]
    denominator: list[list[float]]


@dataclass(frozen=True)
class Truth:
    """The pilot's model, and where that is not the estimator's, what it is."""

    model: str
    about: str | None = None
    about_dynamics: str | None = None
    transfer: TrueTransfer | None = None


@dataclass(frozen=True)
class Firmware:
    """What the estimator said of itself; None where it did not."""

    version: str | None
    contract: int | None
    settings_as_scenario: bool | None
    aircraft_as_scenario: bool | None = True
    """None: on a bus, where nothing says so."""


@dataclass(frozen=True)
class Quality:
    """How one quantity was estimated."""

    rms_percent: float | None
    bias_percent: float | None
    coverage_2sigma: float | None
    """Share of the samples (0 to 1) at which estimate +- 2 sigma holds the truth."""
    time_to_10_percent_s: list[float | None]
    """After the start and each jump, until the error stays within 10 % up to the next jump; None: it never does."""
    time_to_5_percent_s: list[float | None]


@dataclass(frozen=True, kw_only=True)
class SimulationSummary(Summary):
    """Of `lever sim`."""

    scenario: Scenario
    truth: Truth
    firmware: Firmware
    parameters: dict[str, Quality]
    """By quantity, as far as there is a truth."""
    unanswered: int
    misplaced: int
    missed: list[str]
    """Limits, in words."""
    simulated_time_s: float
    wall_time_s: float | None = None
    wall_time_per_simulated_time: float | None = None

    def timed(self, seconds: float) -> SimulationSummary:
        """With how long the run took by the wall clock; the only part that differs between equal runs."""
        return dataclasses.replace(
            self, wall_time_s=seconds, wall_time_per_simulated_time=seconds / self.simulated_time_s
        )


# --- of a replay -----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Estimate:
    """One quantity at the end, and between what it was."""

    unit: str
    last: float | None
    last_sigma: float | None
    least: float | None
    greatest: float | None


@dataclass
class Difference:
    """Replayed minus recorded, of one signal; None where the recording has none of it."""

    unit: str
    samples: int = 0
    """At which both are known."""
    identical_samples: int = 0
    """Equal in every bit on the bus."""
    bias: float | None = None
    """Mean difference."""
    rms: float | None = None
    largest: float | None = None
    """The difference that is farthest from 0, with its sign."""
    largest_at_s: float | None = None
    rms_in_sigma: float | None = None
    """Rms of the difference over the replay's standard deviation; None where there is none."""


@dataclass(frozen=True)
class Comparison:
    """With the estimates that the log holds."""

    identical: bool
    signals: dict[str, Difference]
    in_words: str

    def rows(self) -> list[dict[str, str | float | None]]:
        """Return what tables show of each signal."""
        return [
            {
                "signal": name,
                "unit": each.unit,
                "samples": each.samples,
                "identical": each.identical_samples,
                "mean difference": each.bias,
                "rms difference": each.rms,
                "largest difference": each.largest,
                "at [s]": each.largest_at_s,
                "rms in sigma [1]": each.rms_in_sigma,
            }
            for name, each in self.signals.items()
        ]


@dataclass
class MessageCounts:
    """What was found in the frames of one mapped message."""

    frames: int = 0
    corrupt: int = 0
    """By their CRC; left out."""
    lost: int = 0
    """By their counter."""
    repeated: int = 0
    """By their counter; left out."""
    undecoded: int = 0
    """That do not fit the database; left out."""


@dataclass(frozen=True)
class MappedSignal:
    """What one input of the estimator was made of."""

    signal: str
    unit: str
    factor: float | None
    offset: float
    sign: int | None
    gravity: str
    channel: str | None
    delay_s: float
    rate_hz: float
    sampled: str
    missing: int
    """Samples without a value."""


@dataclass(frozen=True)
class Mapped:
    """How samples were made of a log that does not speak lever.dbc."""

    inputs: dict[str, MappedSignal]
    times: dict[str, str]
    """Unit of each column of time, of a file; empty for dates."""
    clock: str
    sample_period_s: float
    disordered_values: int
    messages: dict[str, MessageCounts]
    unprotected_frames: int
    """Of mapped messages without E2E protection in the mapping."""
    notes: list[str]
    """What was guessed or is odd, a sentence each."""


@dataclass(frozen=True)
class RecordingSummary:
    """What was in the log."""

    logs: list[str]
    channel: str | None
    start: str | None
    """Date and time of the first frame; None where the log does not say."""
    duration_s: float
    frames: int
    frames_left_out: dict[str, int]
    corrupt_recorded_answers: int
    answers_of_other_contract: bool
    """The log holds estimates, of another version of lever.dbc or of an unknown one."""
    misplaced_answers: int
    """Recorded estimates that do not belong to the sample before them."""
    damaged_lines: int
    ends_early: list[str]
    """Why, for each of the logs that does."""
    refused: int
    """Frames, by the firmware."""
    repeated: int
    commands: int
    commands_changed: int
    model_changes: int
    other_buses_with_samples: list[str]
    typical_step_s: float
    gaps: int
    longest_gap_s: float
    late_samples: int
    clock_wraps: int
    clock_restarts: int
    recorder_clock_jumps: int
    mapping: Mapped | None


@dataclass
class Snapshots:
    """What came of the snapshots of the estimator's state in the log."""

    found: int = 0
    equal: int = 0
    different: int = 0
    broken: int = 0
    """Without their end, or without their sample in the log."""
    begun_at_s: float | None = None
    """Recorded time, since the first frame, of the snapshot that the replay began with; None: with the log."""
    left_out: int = 0
    """Frames before that."""
    first_different_s: float | None = None
    last_equal_s: float | None = None
    not_compared: str | None = None
    """Why they could not be."""


@dataclass(frozen=True, kw_only=True)
class ReplaySummary(Summary):
    """Of `lever replay`."""

    recording: RecordingSummary
    estimates: dict[str, Estimate]
    comparison: Comparison | None
    snapshots: Snapshots | None = None
    """None where there are none."""


# --- to and from JSON ------------------------------------------------------------------------------------------------


def text(summary: Summary) -> str:
    """Return the content of summary.json."""
    return json_text(dataclasses.asdict(summary))


def read(path: str | Path) -> SimulationSummary | ReplaySummary:
    """Return a summary.json. Raise LeverError."""
    try:
        content = json.loads(Path(path).read_text(encoding="utf-8"))
        if content["schema"] != SCHEMA:
            raise LeverError(f"{path}: schema {content['schema']}, not {SCHEMA}: of another version")
        return of(ReplaySummary, content) if "recording" in content else of(SimulationSummary, content)
    except OSError as error:
        raise LeverError(f"cannot read {path}: {error.strerror}") from None
    except (ValueError, TypeError, KeyError, RecursionError) as error:
        raise LeverError(f"{path}: not a summary of this version: {error!r}") from None


def of(kind: type[_Content], content: Mapping[str, Any]) -> _Content:
    """Return a dataclass of JSON's dictionaries and lists. Raise TypeError for a field that is unknown or missing."""
    if not isinstance(content, Mapping):
        raise TypeError(f"{content!r} is not of {kind}")
    hints = typing.get_type_hints(kind)
    return kind(**{name: _value(hints.get(name, object), each) for name, each in content.items()})


def _value(kind: Any, content: Any) -> Any:
    is_optional = isinstance(kind, types.UnionType)
    if is_optional:
        (kind,) = (each for each in kind.__args__ if each is not type(None))
    if content is None and (is_optional or kind in (Any, object)):
        return None
    if dataclasses.is_dataclass(kind):
        return of(typing.cast("type[Any]", kind), content)
    of_items: Any = typing.get_origin(kind)
    allowed: Any = {float: (float, int), Any: object}.get(kind, of_items or kind)
    if not isinstance(content, allowed) or (isinstance(content, bool) and kind in (int, float)):
        raise TypeError(f"{content!r} is not of {kind}")
    if of_items is dict:
        return {name: _value(kind.__args__[1], each) for name, each in content.items()}
    return [_value(kind.__args__[0], each) for each in content] if of_items is list else content
