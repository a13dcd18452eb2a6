"""What firmware/port/PORTING.md says is so: its numbers, and its task of an RTOS."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest
import readmes
from lever_cdkf.host_tools.native import FRAME_SAMPLE, Config, Estimator
from target.budget import golden, guide, port_sizes, stack
from target.budget.recording import FRAME, record

PLATFORM_HEALTH = 0x216
RTOS = """
/* Instead of an RTOS: frames come from standard input and go to standard output; the end of the former is the end. */
#include "lever_cdkf.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
void *received;
void *to_send;
static unsigned int turns;
bool queue_take(void *queue, lever_frame_t *frame, uint32_t longest_wait_ms)
{
    struct { uint16_t id; uint8_t data[8]; } wire;
    (void)longest_wait_ms;
    if (queue != received) { exit(2); }
    if ((turns++ % 3u) == 2u) { return false; } /* nothing came in time */
    if (fread(&wire, sizeof wire, 1, stdin) != 1) { exit(0); }
    frame->id = wire.id;
    frame->length = 8u;
    memcpy(frame->data, wire.data, 8);
    return true;
}
bool queue_put(void *queue, const lever_frame_t *frame)
{
    uint16_t id = (uint16_t)frame->id;
    if (queue != to_send || frame->length != 8u) { exit(3); }
    return fwrite(&id, sizeof id, 1, stdout) == 1 && fwrite(frame->data, 8, 1, stdout) == 1;
}
void estimator_task(void *unused);
int main(void) { static int a, b; received = &a; to_send = &b; estimator_task(NULL); return 1; }
"""


def test_its_budget_is_the_accepted_one() -> None:
    values = golden.load()["values"]
    assert guide.section("instructions") == guide.instructions(values), f"{golden.ACCEPT} writes it"
    assert guide.section("memory") == guide.memory(values), f"{golden.ACCEPT} writes it"


@pytest.mark.requires("arm-none-eabi-gcc")
def test_the_four_functions_are_as_large_as_it_says(build_dir: Path) -> None:
    """To 5 %."""
    images = build_dir / "stm32f4"
    sizes = {name: port_sizes.of_port(name, guide.port_image(images, name)) for name in port_sizes.TRANSPORTS}
    said, measured = guide.section("port"), guide.port(sizes)
    numbers = re.compile(r"\d[\d,]*")
    assert numbers.sub("", said) == numbers.sub("", measured), f"{golden.ACCEPT} writes it"
    for old, new in zip(numbers.findall(said), numbers.findall(measured), strict=True):
        of_said, of_measured = (int(each.replace(",", "")) for each in (old, new))
        assert of_measured == pytest.approx(of_said, rel=0.05), f"{golden.ACCEPT} writes it"


@pytest.mark.requires("arm-none-eabi-gcc")
def test_the_loop_takes_the_stack_that_it_says(build_dir: Path) -> None:
    text = guide.GUIDE.read_text(encoding="utf-8")
    said = re.search(r"(\d+) bytes for the loop \((\d+) for `self_test\(\)`", text)
    assert said is not None
    for function, bytes_ in zip(("embedded_turn", "self_test"), said.groups(), strict=True):
        pushed, _ = stack.pushed_by(guide.port_image(build_dir / "stm32f4", "can"), function)
        assert 0.8 * int(bytes_) < pushed <= int(bytes_), function


@pytest.fixture(scope="module")
def task(tmp_path_factory: pytest.TempPathFactory, root: Path, build_dir: Path) -> Path:
    """The guide's task, with the loop and self test of the tree, and a stand-in for the RTOS."""
    folder = tmp_path_factory.mktemp("task")
    (example,) = readmes.blocks(guide.GUIDE, "c").values()
    (folder / "task.c").write_text(str(example), encoding="utf-8")
    (folder / "rtos.c").write_text(RTOS, encoding="utf-8")
    embedded = root / "firmware/port/embedded"
    sources = [
        folder / "task.c",
        folder / "rtos.c",
        *(embedded / name for name in ("loop.c", "self_test.c", "crc32.c")),
    ]
    flags = ["-std=c99", "-O1", "-Wall", "-Wextra", "-Werror", "-ffp-contract=off", f"-I{root / 'firmware'}"]
    library = build_dir / "firmware/liblever_cdkf.a"
    subprocess.run(["cc", *flags, *map(str, sources), str(library), "-lm", "-o", str(folder / "task")], check=True)
    return folder / "task"


@pytest.mark.requires("cc")
def test_its_task_of_an_rtos_answers_as_the_estimator_does(task: Path) -> None:
    """Frame by frame, over three seconds."""
    frames = record("lever").frames[:6000]
    assert frames.dtype == FRAME
    answered = subprocess.run([task], input=frames.tobytes(), capture_output=True, check=True).stdout
    sent = [
        (int.from_bytes(answered[i : i + 2], "little"), answered[i + 2 : i + 10]) for i in range(0, len(answered), 10)
    ]

    estimator = Estimator(Config(settings={"lever_length": 0.42}))
    expected = []
    for identifier, data in frames.tolist():
        if estimator.on_frame(identifier, bytes(data)) == FRAME_SAMPLE:
            estimator.step()
            while (answer := estimator.next_frame()) is not None:
                expected.append(answer)
    assert [frame for frame in sent if frame[0] != PLATFORM_HEALTH] == expected
    assert PLATFORM_HEALTH in {identifier for identifier, _ in sent}
    assert len(expected) > 3000
