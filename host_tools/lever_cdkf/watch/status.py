"""Modes and faults in words; the façade header defines them."""

from __future__ import annotations

import math

from ..can import codec
from ..firmware.estimator import TEST_RATIOS
from ..firmware.library import enum_names, enum_words
from ..results import trust
from .picture import Picture
from .sources import Source

SELF_TESTS = {1: "program memory", 2: "RAM", 4: "stack", 8: "golden vector", 16: "settings or aircraft of its build"}
"""Bits of enum message_self_test (firmware/can/messages.h)."""

NOTHING = "–"
SILENT_AFTER = 1.0
"""[s] without a frame after which that is said."""


def of_source(picture: Picture, source: Source) -> tuple[str, str]:
    """Return condition(), or what has become of the source, if that has failed or ended."""
    if source.error is not None:
        return "bad", source.error
    if source.ended:
        return "watch", f"the end: {source.warning or 'nothing more will come'}"
    return condition(picture)


def condition(picture: Picture) -> tuple[str, str]:
    """Return the state of the estimator in one line: ("good", "watch" or "bad", text)."""
    silence = picture.silence()
    if silence > SILENT_AFTER:
        if silence != float("inf"):
            return "bad", f"no frame from the estimator for {silence:.0f} s: what is shown is old"
        if picture.is_fresh("BASE_SAMPLE"):
            return "bad", "samples pass, but no estimator answers: is the firmware running?"
        if any(entry.frames for entry in picture.traffic.values()) or picture.foreign:
            return "watch", "frames pass, but neither samples nor estimates"
        return "watch", "no frame has come yet"
    if (wrong := picture.wrong_contract()) is not None:
        return "bad", wrong
    mode = picture.mode
    if mode is None:
        return "watch", "the estimator is there; no HEALTH from it yet"
    near = bounce(picture)
    if near is not None and near[0] != "good":
        return near[0], f"collective bounce, {near[1]}"
    level = {"run": "good", "fault": "bad"}.get(mode, "watch")
    if level == "good" and (present := faults(picture)):
        return "watch", f"{mode}, but: {'; '.join(present)}"
    return level, f"{mode}: {enum_words('lever_mode').get(mode, 'a mode that this program does not know')}"


def bounce(picture: Picture) -> tuple[str, str] | None:
    """Return how near collective bounce is, as condition(); None from an estimator that does not know the aircraft."""
    state = picture.field("STABILITY", "bounce")
    if math.isnan(state):
        return None
    name = enum_names("lever_bounce")[int(state)]
    margin, sigma, frequency = (
        picture.field("STABILITY", field) for field in ("gain_margin", "gain_margin_sigma", "frequency")
    )
    level = {"warning": "watch", "alarm": "bad"}.get(name, "good")
    if math.isnan(margin):
        return level, f"{name}: the margin is not known"
    at = "" if math.isnan(frequency) else f" at {frequency:.1f} Hz"
    return level, f"{name}: gain margin {margin:.1f} ± {sigma:.1f} dB{at}"


def nearest_evidence(picture: Picture) -> str | None:
    """Return the three statistics that are nearest to their thresholds, or over them; None where they are not sent."""
    ratios = picture.test_ratios()
    nearest = sorted((key for key in ratios if key < len(TEST_RATIOS)), key=lambda key: -ratios[key])[:3]
    texts = [f"{TEST_RATIOS[key].replace('_', ' ')} {ratios[key]:.2f}" for key in nearest]
    return f"{', '.join(texts)} (threshold 1)" if texts else None


def facts(picture: Picture, source: Source) -> list[tuple[str, str, str]]:
    """Return what there is to say of the estimator's health: name, text, and the level of condition() or nothing."""
    counts, dither = picture.counts, "off"
    if picture.dither() > 0.0:
        dither = f"{picture.dither():.3f} N m rms"
    if picture.identity.dither_rms:
        dither += f", asked {picture.identity.dither_rms:g}"
    present = faults(picture)
    level = ("watch" if present else "good") if picture.mode else ""
    rows = [
        ("mode", picture.mode or NOTHING, ""),
        (
            "choices",
            ", ".join(name for what, name in picture.identity.choices.items() if what != "model") or NOTHING,
            "",
        ),
        ("counts", f"{counts['lost']} lost, {counts['corrupt']} corrupt, {counts['late']} late", ""),
        ("excitation", f"{number(picture.field('HEALTH', 'excitation'), 2)} rad/s", ""),
        ("dither", dither, ""),
        ("mean NIS", f"{number(picture.nis())} (expected 2)", ""),
    ]
    if (near := bounce(picture)) is not None:
        rows.append(("bounce", near[1], near[0]))
    rows.append(("theta", f"{number(math.degrees(picture.theta()))} deg", ""))
    if picture.is_fresh("PLATFORM_HEALTH"):
        errors = [round(picture.field("PLATFORM_HEALTH", name)) for name in ("transmit_errors", "receive_errors")]
        rows.append(("TEC, REC", f"{errors[0]}, {errors[1]}; off bus {counts['bus_offs']}", ""))
        rows.append(("machine", f"{counts['overruns']} lost, {counts['dropped']} dropped", ""))
    if (reset := last_reset(picture)) is not None:
        rows.append(("last reset", reset, ""))
    rows.append(("faults", "; ".join(present) or ("none" if picture.mode else NOTHING), level))
    if (nearest := nearest_evidence(picture)) is not None:
        rows.append(("evidence", nearest, ""))
    others = {
        "restarts": counts["restarts"],
        "other frames": picture.foreign,
        "error frames": picture.error_frames,
        "unseen": source.dropped,
    }
    return rows + [(name, str(count), "") for name, count in others.items() if count]


def number(value: float, digits: int = 4) -> str:
    """Return a number with so many digits, without exponent; a dash for what is not known."""
    if not math.isfinite(value):
        return NOTHING
    if value == 0.0:
        return "0"
    decimals = min(5, max(0, digits - 1 - math.floor(math.log10(abs(value)))))
    return f"{value:.{decimals}f}"


def last_reset(picture: Picture) -> str | None:
    """Return what made the machine start last, and what its self tests have found since; None if it does not say."""
    if not picture.is_fresh("PLATFORM_RESET"):
        return None
    names = ("cause", "resets", "failed", "fault_address")
    cause, resets, failed, address = (int(picture.field("PLATFORM_RESET", name)) for name in names)
    causes = codec.choices("PLATFORM_RESET", "cause")
    parts = [f"{causes.get(cause, str(cause)).replace('_', ' ')}, {resets} since power-on"]
    if tests := [name for bit, name in SELF_TESTS.items() if failed & bit]:
        parts.append(f"failed: {', '.join(tests)}")
    if address:
        parts.append(f"hard fault at {address:#010x}")
    return "; ".join(parts)


def faults(picture: Picture) -> list[str]:
    """Return the faults of the estimator and its machine, in words."""
    machine = picture.platform_faults()
    named = [name for name in picture.faults() if not (machine and name == "platform")]
    numbered = picture.test_ratios()
    ratios = {TEST_RATIOS[key]: ratio for key, ratio in numbered.items() if key < len(TEST_RATIOS)}
    evidence = {name: ratios[name] for name in trust.EVIDENCE if ratios.get(name, 0.0) > 1.0} if ratios else None
    step = trust.next_step({"calibration": 1.0}, "`lever tune` finds what is stated wrong from a log", evidence)
    texts = [trust.in_words(name, evidence, *([step] if name == "calibration" and evidence else [])) for name in named]
    return texts + [f"machine: {enum_words('lever_platform_fault')[name]}" for name in machine or ()]
