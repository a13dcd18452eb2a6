"""lever_can as a process on a virtual CAN interface: what goes wrong around it must not show in its answers.

The answers are compared, byte for byte, with those of the firmware in this process.
"""

from __future__ import annotations

import signal
import socket
import struct
import subprocess
import time
from pathlib import Path

import can
import pytest
from lever_cdkf.can import codec
from lever_cdkf.can.bus import LeverBus
from vcan import rig

SAMPLES = 150
HEALTH, IDENTITY, LINK_HEALTH = 0x214, 0x217, 0x219


def refusal(program: Path, interface: str) -> str:
    """Return the one line with which lever_can says that it cannot use the interface."""
    result = subprocess.run([program, "--can", interface], capture_output=True, text=True, timeout=rig.PATIENCE_S)
    assert result.returncode == 1
    assert result.stdout == ""
    assert result.stderr.count("\n") == 1
    return result.stderr.removeprefix(f"lever_can: {interface}: ")


def test_an_interface_that_is_missing(build_dir: Path) -> None:
    expected = "no such interface; a virtual one is made by: ip link add dev no0 type vcan && ip link set no0 up\n"
    assert refusal(build_dir / "lever_can", "no0") == expected


def test_an_interface_that_is_down_at_the_start(build_dir: Path, interface: str) -> None:
    rig.ip("link", "set", interface, "down")
    expected = f"the interface is down; bring it up by: ip link set {interface} up\n"
    assert refusal(build_dir / "lever_can", interface) == expected


def test_an_interface_that_is_not_can(build_dir: Path) -> None:
    assert refusal(build_dir / "lever_can", "lo") == "not a CAN interface\n"


@pytest.mark.requirement("R49")
def test_its_answers_are_those_of_the_firmware_in_this_process(start: rig.Starter, host: rig.Host) -> None:
    process = start()
    began = time.perf_counter()
    answers = host.run(4 * SAMPLES)
    rate = 4 * SAMPLES / (time.perf_counter() - began)
    print(f"{rate:.0f} lock-step round trips a second")
    assert answers == rig.in_process(4 * SAMPLES)
    totals = process.stop()
    assert totals["samples"] == 4 * SAMPLES
    assert totals["frames in"] == 8 * SAMPLES
    assert totals["frames out"] == len(answers)
    assert {name for name, count in totals.items() if count} == {"samples", "frames in", "frames out"}


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it_well(start: rig.Starter, number: signal.Signals, host: rig.Host) -> None:
    process = start()
    host.run(10)
    assert process.stop(number)["samples"] == 10
    assert process.stderr == ""


def test_a_signal_ends_it_under_full_load(start: rig.Starter, interface: str) -> None:
    process = start()
    flood = subprocess.Popen(["cangen", interface, "-g", "0", "-i", "-I", "110", "-L", "8"])
    try:
        sent = Path(f"/sys/class/net/{interface}/statistics/tx_packets")
        rig.wait_until(lambda: int(sent.read_text()) > 3000, "cangen sends")
        assert process.stop()["frames in"] > 0
    finally:
        flood.kill()
        flood.wait()


@pytest.mark.requirement("R50")
def test_it_goes_on_after_the_interface_was_down(start: rig.Starter, interface: str, host: rig.Host) -> None:
    process = start()
    answers = host.run(SAMPLES)
    rig.ip("link", "set", interface, "down")
    process.wait_for("link lost (Network is down); waiting for it with the estimate kept")
    rig.ip("link", "set", interface, "up")
    process.wait_for("link restored")
    host.reopen(interface)
    answers += host.run(SAMPLES)
    assert answers == rig.in_process(2 * SAMPLES)
    assert process.stderr.count("\n") == 2
    assert process.stop()["outages"] == 1


def test_it_goes_on_after_the_interface_was_deleted_and_made_again(
    start: rig.Starter, interface: str, host: rig.Host
) -> None:
    process = start()
    answers = host.run(SAMPLES)
    rig.ip("link", "delete", interface)
    process.wait_for("link lost")
    time.sleep(0.1)
    rig.ip("link", "add", "dev", interface, "type", "vcan")
    time.sleep(0.1)  # it exists, but is down: not yet
    assert "restored" not in process.stderr
    rig.ip("link", "set", interface, "up")
    process.wait_for("link restored")
    host.reopen(interface)
    answers += host.run(SAMPLES)
    assert answers == rig.in_process(2 * SAMPLES)
    assert process.stderr.count("\n") == 2
    process.stop()


@pytest.mark.requires("tc")
def test_no_frame_is_dropped_when_the_interface_has_no_room(start: rig.Starter, interface: str, host: rig.Host) -> None:
    """A queue of two frames, emptied at about 500 frames a second: ENOBUFS all the time."""
    slow = ["tc", "qdisc", "add", "dev", interface, "root", "tbf", "rate", "64kbit", "burst", "80", "limit", "40"]
    subprocess.run(slow, check=True)
    process = start("--set", "publish_period=0.002")
    answers = host.run(SAMPLES)
    assert host.nothing_more()
    totals = process.stop()
    assert totals["held"] > 0
    assert totals["frames out"] == len(answers)
    assert totals["unsent"] == 0
    assert answers == rig.in_process(SAMPLES, publish_period=0.002)


def test_foreign_and_broken_frames_do_not_disturb(start: rig.Starter, host: rig.Host) -> None:
    foreign = [
        can.Message(arbitration_id=0x7FF, is_extended_id=False, data=bytes(range(8))),
        can.Message(arbitration_id=0x110, is_extended_id=True, data=bytes(range(8))),
        can.Message(arbitration_id=0x110, is_extended_id=False, is_remote_frame=True),
        can.Message(arbitration_id=0x111, is_extended_id=False, is_remote_frame=True, dlc=8),
        can.Message(arbitration_id=0x000, is_extended_id=False),
    ]
    broken = [
        can.Message(arbitration_id=identifier, is_extended_id=False, data=data)
        for identifier, data in [
            (0x110, b""),
            (0x110, b"\x11"),
            (0x111, bytes(7)),
            (0x110, bytes(8)),
            (0x111, 8 * b"\xff"),
            (0x120, bytes(range(8))),
        ]
    ]
    process = start()
    answers = []
    for frame in (*foreign, *broken):
        answers += host.run(20)
        host.bus.send(frame)
    answers += host.run(20)
    samples = 20 * (len(foreign) + len(broken) + 1)
    tell_of_them = (HEALTH, LINK_HEALTH)
    answers, expected = ([f for f in each if f[0] not in tell_of_them] for each in (answers, rig.in_process(samples)))
    assert answers == expected
    totals = process.stop()
    assert totals["samples"] == samples
    assert totals["corrupt"] == len(broken)
    assert totals["frames in"] == 2 * samples + len(broken)


def test_a_motor_command_does_not_wait_for_the_interface(start: rig.Starter, interface: str, host: rig.Host) -> None:
    """Stopped, the process has a sample to answer when the interface goes down. Once this was sent 3 s later."""
    process = start(supervised=True)
    host.run_with_torque()
    process.process.send_signal(signal.SIGSTOP)
    for frame in next(rig.samples(host.samples_sent, 1)):
        host.send(frame)
    rig.ip("link", "set", interface, "down")
    process.process.send_signal(signal.SIGCONT)
    process.wait_for("link lost")
    time.sleep(0.2)
    rig.ip("link", "set", interface, "up")
    host.reopen(interface)  # before the next attempt to restore the link
    process.wait_for("link restored")
    assert not any(rig.torques(host.rest()))
    process.stop()


def test_another_estimator_on_the_bus_is_noticed(start: rig.Starter, host: rig.Host) -> None:
    """Its IDENTITY passes the receive filter."""
    process = start()
    answers = host.run(20)
    host.send(next(frame for frame in answers if frame[0] == IDENTITY))
    health = [codec.decode(*frame)[1] for frame in host.run(200) if frame[0] == HEALTH]
    assert any(each["fault_duplicate"] for each in health)
    assert process.stop()["frames in"] == 2 * 220 + 1


@pytest.mark.requires("cangen")
@pytest.mark.requirement("R50")
def test_a_full_receive_buffer_is_counted(start: rig.Starter, interface: str, host: rig.Host) -> None:
    """While the process is stopped more frames come than the kernel keeps for it."""
    process = start()
    process.process.send_signal(signal.SIGSTOP)
    flood = 20000
    subprocess.run(["cangen", interface, "-g", "0", "-i", "-I", "110", "-L", "8", "-n", str(flood)], check=True)
    process.process.send_signal(signal.SIGCONT)
    host.reach()  # what was sent before is taken or lost by then
    totals = process.stop()
    assert totals["overflowed"] > 0
    assert totals["frames in"] + totals["overflowed"] == flood + 2 * host.samples_sent


@pytest.mark.requires("cangen")
@pytest.mark.requirement("R50")
def test_a_flood_does_not_keep_samples_from_their_answers(start: rig.Starter, interface: str, host: rig.Host) -> None:
    """Frames of half the length, as fast as they can be sent, each of which the estimator has to refuse."""
    process = start()
    flood = 5000
    words = ["cangen", interface, "-g", "0", "-i", "-I", "110", "-L", "4", "-n", str(flood)]
    with subprocess.Popen(words) as generator:
        while generator.poll() is None:
            host.reach()
    host.reach()
    totals = process.stop()
    assert totals["frames in"] + totals["overflowed"] == flood + 2 * host.samples_sent
    assert totals["corrupt"] <= flood <= totals["corrupt"] + totals["overflowed"]
    assert totals["samples"] > 0


@pytest.mark.requirement("R50")
def test_another_takes_over_from_one_that_is_killed(start: rig.Starter, host: rig.Host) -> None:
    """In the middle of a sample; the other starts as with the first sample that it gets."""
    first = start()
    host.run(SAMPLES)
    host.send(next(rig.samples(host.samples_sent, 1))[0])
    first.process.kill()
    first.process.wait(rig.PATIENCE_S)
    host.rest()
    second = start()
    answers = host.run(SAMPLES)
    with LeverBus(settings=rig.SETTINGS) as bus:
        fresh = rig.Host(bus)
        fresh.samples_sent = SAMPLES
        assert answers == fresh.run(SAMPLES)
    assert second.stop()["samples"] == SAMPLES


@pytest.mark.requirement("R50")
def test_two_on_one_bus_both_answer_and_both_say_so(
    build_dir: Path, start: rig.Starter, interface: str, host: rig.Host, tmp_path: Path
) -> None:
    first = start()
    (tmp_path / "second").mkdir()
    answers: list[rig.Frame] = []
    with rig.LeverCan(build_dir / "lever_can", interface, [], tmp_path / "second") as second:
        for frames in rig.samples(0, SAMPLES):
            for frame in frames:
                host.send(frame)
            answers += host.answer() + host.answer()
        answers += host.rest()
        for process in (first, second):
            totals = process.stop()
            assert totals["samples"] == SAMPLES
            assert totals["frames in"] > 2 * SAMPLES  # IDENTITY of the other
            assert totals["lost"] == totals["corrupt"] == totals["late"] == totals["overflowed"] == 0
    estimates = [frame for frame in answers if frame[0] == rig.STATE_ESTIMATE]
    alone = [frame for frame in rig.in_process(SAMPLES) if frame[0] == rig.STATE_ESTIMATE]
    assert sorted(estimates) == sorted(2 * alone)
    flags = [codec.decode(*frame)[1]["fault_duplicate"] for frame in answers if frame[0] == HEALTH]
    assert sum(flags) >= 2


def test_a_change_of_the_bus_condition_is_told_once(start: rig.Starter, interface: str) -> None:
    err_flag, bus_off, controller, restarted = 0x20000000, 0x40, 0x04, 0x100
    process = start()
    with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as injector:
        injector.bind((interface,))
        for identifier, data in [
            (controller, b"\0\x20" + bytes(6)),
            (bus_off, bytes(8)),
            (bus_off, bytes(8)),
            (restarted, bytes(8)),
            (bus_off, bytes(8)),
        ]:
            injector.send(struct.pack("=IB3x8s", err_flag | identifier, 8, data))
    process.wait_for("bus-off", times=2)
    messages = [line.split(": ", 2)[2] for line in process.stderr.splitlines()]
    words = ["error-passive", "bus-off", "the controller has restarted", "bus-off"]
    assert [line.split(":")[0] for line in messages] == words
    host = rig.Host.on(interface)
    assert host.run(20) == rig.in_process(20)
    process.stop()
    host.bus.shutdown()
