"""The measurement itself: the image computes what the host computes, its clock counts instructions, stack is found."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import Built
from lever_cdkf.errors import LeverError
from lever_cdkf.firmware.aircraft import AircraftResponse
from lever_cdkf.firmware.config import CHOICES, Config
from lever_cdkf.firmware.library import enum_names, ffi, lib
from target.budget import image, measure, stack, trace
from target.budget.recording import MODELS, record

pytestmark = pytest.mark.requires("arm-none-eabi-gcc", "qemu-system-arm")
FAULTS = {name: bit for bit, name in enum_names("lever_fault").items()}
Runs = dict[measure.Case, image.Run]


SAID = ("lever_estimate_t", "lever_stability_t", "lever_correction_t")


def aircraft_of_image() -> AircraftResponse:
    """As main.c has it."""
    source = (image.SOURCE / "main.c").read_text(encoding="utf-8")
    lists = {
        name: re.search(rf"\.{name} = {{(.*?)}}", source, re.DOTALL) for name in ("frequency", "real", "imaginary")
    }
    numbers = {
        name: [float(each) for each in re.findall(r"[-\d.]+", found[1])] for name, found in lists.items() if found
    }
    response = [complex(*each) for each in zip(numbers["real"], numbers["imaginary"], strict=True)]
    return AircraftResponse(numbers["frequency"], response, gain_sigma=0.05, phase_sigma=0.05)


def said_on_host(model: str, estimator: str, form: str) -> list[Any]:
    """After the last sample, from the library of this machine."""
    recording = record(model)
    scenario = recording.scenario
    mitigation = image.mitigation(form)
    choices = {**scenario.config.choices, "model": model, "estimator": estimator, "mitigation": mitigation}
    config, aircraft = Config(**choices, settings=scenario.settings), aircraft_of_image()
    memory = ffi.new("lever_memory_t *")
    lever = lib.lever_init(memory, config.pointer)
    if form == "bounce":
        assert lib.lever_aircraft(lever, aircraft.pointer)
    keep = dict.fromkeys(CHOICES, lib.LEVER_KEEP)
    command = ffi.new("lever_command_t *", {**keep, "dither_rms": recording.dither_rms})
    assert lib.lever_command(lever, command)
    samples = ffi.from_buffer("lever_sample_t[]", recording.samples)
    assert len(samples) == len(recording.samples)
    for i in range(len(samples)):
        if i % 500 == 0:
            lib.lever_command(lever, command)  # as image/main.c does
        lib.lever_update(lever, samples + i)
    said = [ffi.new(f"{name} *") for name in SAID]
    for ask, into in zip((lib.lever_estimate, lib.lever_stability, lib.lever_correction), said, strict=True):
        ask(lever, into)
    return said


def fields(struct: Any) -> dict[str, Any]:
    """Return the fields of a pointer to one, by name; arrays as lists."""
    values = {name: getattr(struct, name) for name, _ in ffi.typeof(struct).item.fields}
    return {name: list(value) if isinstance(value, ffi.CData) else value for name, value in values.items()}


@pytest.mark.parametrize(("estimator", "model", "form"), image.cases())
def test_the_image_computes_what_the_host_computes(runs: Runs, estimator: str, model: str, form: str) -> None:
    """To the bit, from samples and from frames; with an aircraft and a mitigation, margin and correction, too."""
    target, at = runs[estimator, model, form].said, 0
    assert len(target) == sum(map(ffi.sizeof, SAID))
    for name, host in zip(SAID, said_on_host(model, estimator, form), strict=True):
        part = target[at : at + ffi.sizeof(name)]  # which the pointer does not keep alive
        assert fields(ffi.from_buffer(f"{name} *", part)) == fields(host), name
        at += len(part)
    assert (runs[estimator, model, form].said[-8:] != bytes(8)) == (form == "bounce")


def test_a_processor_without_fpu_computes_the_same(runs: Runs, built: Built) -> None:
    """And takes about twenty times the instructions: PORTING.md."""
    elf = built("target/soft_float/budget.elf", "build.budget")
    soft, hard = image.run(elf, record("lever"), "lever", "dual", "update"), runs["dual", "lever", "update"]
    assert soft.said == hard.said
    assert 15.0 < soft.instructions.mean() / hard.instructions.mean() < 25.0


@pytest.mark.parametrize(("estimator", "model"), [(each, model) for each in image.ESTIMATORS for model in MODELS])
def test_the_recording_makes_the_estimator_work(runs: Runs, estimator: str, model: str) -> None:
    """It aligns, runs, learns from every sample that is counted as steady, notices the change at 6 s, and publishes."""
    run, time = runs[estimator, model, "tick"], measure.sample_times(record(model))
    steady = measure.is_steady(run, time)
    modes = [enum_names("lever_mode")[code] for code in run.mode]
    assert modes[0] == "align"
    assert set(modes[1000:]) == {"run"}
    changes = time[(run.faults & FAULTS["change"]) != 0]
    assert 6.0 < changes[changes > 3.0][0] < 8.0
    assert not (run.faults & (FAULTS["recovered"] | FAULTS["communication"])).any()
    assert not (run.faults[steady] & (FAULTS["excitation"] | FAULTS["settling"])).any()  # nothing stops learning
    each = 1 + int(model != "linear_black_box")  # STATE_ESTIMATE, and MOTOR_COMMAND where there is a motor
    assert run.frames[2000:].min() == each  # the others come now and then
    assert run.frames.max() <= 7  # PORTING.md


def test_qemu_and_unicorn_count_the_same(elf: Path, runs: Runs) -> None:
    """But for the one instruction by which a clock of 1.344 ticks an instruction can be off."""
    for form in image.FORMS:
        traced = trace.trace(elf, record("lever"), "lever", "joint", form, trace.INIT, 6299)
        run = runs["joint", "lever", form]
        counted = np.concatenate(([run.init], run.instructions[:6300]))
        assert np.abs(traced.instructions - counted).max() <= 1
        assert counted[1:].max() > 1.05 * counted[1:].min()  # it is not one number


def test_the_clock_is_calibrated_in_every_run(runs: Runs) -> None:
    for run in runs.values():
        assert run.loop_instructions == 200000
        assert abs(run.loop_measured - 200000) <= 1.0
        assert run.overhead <= 2


def test_a_wrong_clock_is_refused() -> None:
    words = [1, 268801 + 135, 100000, *(0 for _ in image.CALLED_ONCE), 0, 0]
    with pytest.raises(LeverError, match="timed as 200100"):
        image._read(np.array(words, "<u4").tobytes(), 0)


# --- stack ---


def test_no_call_wrote_more_stack_than_was_computed(elf: Path, runs: Runs) -> None:
    computed = {name: chain.bytes for name, chain in stack.worst_case(elf, measure.facade(image.FIRMWARE)).items()}
    assert set(image.CALLED_ONCE) < set(computed)
    tick = max(computed[name] for name in ("lever_on_frame", "lever_step", "lever_next_frame"))
    for (_, _, form), run in runs.items():
        most = tick if form == "tick" else computed["lever_update"]
        assert 0.8 * most < run.stack.max() <= most
        for name, seen in run.calls_stack.items():
            assert seen <= computed[name], name


def graph_of(tmp_path: Path, source: str) -> stack.CallGraph:
    """Return the call graph of a file that is as if it were filter/it.c."""
    folder = tmp_path / "filter"
    folder.mkdir()
    (folder / "it.c").write_text(source)
    target = folder / "it.c.obj"
    flags = (
        "-mcpu=cortex-m4",
        "-mthumb",
        "-O1",
        "-fno-inline",
        "-fno-optimize-sibling-calls",
        "-fcallgraph-info=su,da",
    )
    subprocess.run([image.tool("gcc"), *flags, "-c", str(folder / "it.c"), "-o", str(target)], check=True)
    return stack.CallGraph({"filter/it.c": target}, target, target.with_suffix(".ci"))


def test_the_call_graph_follows_a_pointer_to_the_deepest(tmp_path: Path) -> None:
    graph = graph_of(
        tmp_path,
        """
        void use(volatile char *x);
        static void small(void) { volatile char x[16]; x[0] = 0; }
        static void large(void) { volatile char x[400]; x[0] = 0; }
        void (*const table[2])(void) = {small, large};
        void top(int i) { table[i](); }
        """,
    )
    deepest = graph.deepest("top")
    assert [name for name, _ in deepest.chain] == ["top", "filter/it.c:large"]
    assert 400 < deepest.bytes < 430


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("int top(int n) { return n ? top(n - 1) * 3 + 1 : 0; }", "circle: top > top"),
        ("void use(char *x); void top(int n) { char x[n]; use(x); }", "top: its stack frame has no bound"),
        ("void top(void (*f)(void)) { f(); }", "calls through a pointer"),
        ("void elsewhere(void); void top(void) { elsewhere(); elsewhere(); }", "elsewhere is called"),
    ],
    ids=["recursion", "no bound", "pointer", "unknown"],
)
def test_what_cannot_be_bounded_is_refused(tmp_path: Path, source: str, message: str) -> None:
    with pytest.raises(LeverError, match=message):
        graph_of(tmp_path, source).deepest("top")


# --- a dearer firmware is noticed ---


def test_a_dearer_firmware_is_noticed(elf: Path, runs: Runs, built: Built) -> None:
    """A buffer of 1600 bytes that is filled in each step."""
    dearer = built("target/dearer/budget.elf", "build.budget")
    run, was = image.run(dearer, record("lever"), "lever", "dual", "update"), runs["dual", "lever", "update"]
    assert run.instructions[-1] >= was.instructions[-1] + 600
    assert run.stack.max() >= was.stack.max() + 1000
    deepest, before_that = (stack.worst_case(each, ["lever_update"])["lever_update"].bytes for each in (dearer, elf))
    assert deepest >= before_that + 1000
    assert run.said == was.said
