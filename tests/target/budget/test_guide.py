"""What firmware/port/PORTING.md says is so: its numbers, and its task of an RTOS."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest
import readmes
from lever_cdkf.firmware.native import FRAME_SAMPLE, Config, Estimator
from target.budget import golden, guide, port_sizes, stack
from target.budget.recording import FRAME, record

PLATFORM_HEALTH = 0x216
RTOS = """
/* Instead of an RTOS: each task is a thread with a file of frames in and one out; the end of the former is its end. */
#include "lever_cdkf.h"
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
extern void start_estimators(void *received[2], void *to_send[2]);
static pthread_t threads[2];
static int started;
static __thread uint32_t calls;
bool queue_take(void *queue, lever_frame_t *frame, uint32_t longest_wait_ms)
{
    struct { uint16_t id; uint8_t data[8]; } wire;
    if ((longest_wait_ms > 5u) || ((calls++ % 3u) == 2u)) { return false; } /* nothing came in time */
    if (fread(&wire, sizeof wire, 1, queue) != 1) { pthread_exit(NULL); }
    frame->id = wire.id;
    frame->length = 8u;
    memcpy(frame->data, wire.data, 8);
    return true;
}
bool queue_put(void *queue, const lever_frame_t *frame)
{
    uint16_t id = (uint16_t)frame->id;
    return (frame->length == 8u) && fwrite(&id, sizeof id, 1, queue) == 1 && fwrite(frame->data, 8, 1, queue) == 1;
}
uint32_t uptime_us(void) { return calls; }
struct start { void (*task)(void *context); void *context; };
static void *run_task(void *start) { ((struct start *)start)->task(((struct start *)start)->context); return NULL; }
void start_task(void (*task)(void *context), void *context)
{
    struct start *start = malloc(sizeof *start);
    start->task = task;
    start->context = context;
    if (pthread_create(&threads[started++], NULL, run_task, start) != 0) { exit(1); }
}
int main(int argc, char *argv[])
{
    void *received[2], *to_send[2];
    if (argc != 4) { return 1; }
    for (int i = 0; i < 2; i++) { received[i] = fopen(argv[1], "rb"); to_send[i] = fopen(argv[2 + i], "wb"); }
    start_estimators(received, to_send);
    for (int i = 0; i < 2; i++) { pthread_join(threads[i], NULL); fclose(to_send[i]); }
    return 0;
}
"""


def test_its_budget_is_the_accepted_one() -> None:
    values = golden.load()["values"]
    assert guide.section("instructions") == guide.instructions(values), f"{golden.ACCEPT} writes it"
    assert guide.section("memory") == guide.memory(values), f"{golden.ACCEPT} writes it"


@pytest.mark.requires("arm-none-eabi-gcc")
def test_the_callbacks_are_as_large_as_it_says(can_image: Path, slcan_image: Path) -> None:
    """To 5 %."""
    sizes = {
        name: port_sizes.of_port(name, image)
        for name, image in zip(port_sizes.TRANSPORTS, (can_image, slcan_image), strict=True)
    }
    said, measured = guide.section("port"), guide.port(sizes)
    numbers = re.compile(r"\d[\d,]*")
    assert numbers.sub("", said) == numbers.sub("", measured), f"{golden.ACCEPT} writes it"
    for old, new in zip(numbers.findall(said), numbers.findall(measured), strict=True):
        of_said, of_measured = (int(each.replace(",", "")) for each in (old, new))
        assert of_measured == pytest.approx(of_said, rel=0.05), f"{golden.ACCEPT} writes it"


@pytest.mark.requires("arm-none-eabi-gcc")
def test_the_loop_takes_the_stack_that_it_says(can_image: Path) -> None:
    text = guide.GUIDE.read_text(encoding="utf-8")
    said = re.search(r"(\d+) bytes for the loop \((\d+) for `self_test\(\)`", text)
    assert said is not None
    for function, bytes_ in zip(("loop_turn", "self_test"), said.groups(), strict=True):
        pushed, _ = stack.pushed_by(can_image, function)
        assert 0.8 * int(bytes_) < pushed <= int(bytes_), function


@pytest.fixture(scope="module")
def tasks(tmp_path_factory: pytest.TempPathFactory, root: Path, build_dir: Path) -> Path:
    """Return the guide's two tasks, with the loop and self test of the tree, and a stand-in for the RTOS."""
    folder = tmp_path_factory.mktemp("tasks")
    (example,) = (text for text in readmes.blocks(guide.GUIDE, "c").values() if "estimator_task" in text)
    (folder / "tasks.c").write_text(example, encoding="utf-8")
    (folder / "rtos.c").write_text(RTOS, encoding="utf-8")
    port = root / "firmware/port"
    sources = [
        folder / "tasks.c",
        folder / "rtos.c",
        *(port / name for name in ("loop.c", "embedded/self_test.c", "embedded/crc32.c")),
    ]
    flags = ["-std=c99", "-O1", "-Wall", "-Wextra", "-Werror", "-ffp-contract=off", f"-I{root / 'firmware'}"]
    library = build_dir / "firmware/liblever_cdkf.a"
    command = ["cc", *flags, "-pthread", *map(str, sources), str(library), "-lm", "-o", str(folder / "tasks")]
    subprocess.run(command, check=True)
    return folder / "tasks"


@pytest.mark.requires("cc")
def test_its_two_tasks_answer_as_two_estimators_do(tasks: Path, tmp_path: Path) -> None:
    """Frame by frame, over three seconds, in one image."""
    frames = record("lever").frames[:6000]
    assert frames.dtype == FRAME
    samples, *answers = (tmp_path / name for name in ("samples", "first", "second"))
    samples.write_bytes(frames.tobytes())
    subprocess.run([tasks, samples, *answers], check=True)
    answered = [read_frames(answer.read_bytes()) for answer in answers]
    for sent, settings in zip(answered, ({}, {"lever_length": 0.42}), strict=True):
        estimator = Estimator(Config(settings=settings))
        expected = []
        for identifier, data in frames.tolist():
            if estimator.on_frame(identifier, bytes(data)) == FRAME_SAMPLE:
                estimator.step()
            while (answer := estimator.next_frame()) is not None:
                expected.append(answer)
        assert [frame for frame in sent if frame[0] != PLATFORM_HEALTH] == expected
        assert PLATFORM_HEALTH in {identifier for identifier, _ in sent}
        assert len(expected) > 3000
    assert answered[0] != answered[1]


def read_frames(data: bytes) -> list[tuple[int, bytes]]:
    return [(int.from_bytes(data[i : i + 2], "little"), data[i + 2 : i + 10]) for i in range(0, len(data), 10)]
