"""Snapshots in a log: where a replay may begin if the log begins anywhere, and whether it is still the recorded flight.

A SNAPSHOT holds the state of the recorded estimator after a sample. The replayed one has the same state there, to the
bit, or something was lost or changed on the way: then the replay goes on with the recorded state, so that each stretch
between two snapshots is judged by itself.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterator, Mapping

import numpy as np

from ..can import codec, snapshots
from ..can.bulk import Feeder, Frames
from ..can.commander import KEEP
from ..can.snapshots import Snapshot
from ..firmware.config import CHOICES
from ..firmware.estimator import Estimator, state_layout
from ..firmware.library import enum_names
from ..results.summary import Snapshots

_LONGEST_US = 20_000_000
"""Two periods of the longest between snapshots: after that a snapshot that has begun does not end any more."""
_SILENT_US = 1_000_000
"""Without a frame of a snapshot for so long from the start on, there are none."""
_SAMPLES_LATE = 8
"""Samples that a recorder may have seen before the SNAPSHOT of an earlier one."""


OTHER_CHOICES = "other choices were made for the replay"


class Proof:
    """Sits between the frames of a log and an estimator that has taken none yet."""

    def __init__(self, estimator: Estimator, another: Callable[[], Estimator], chosen: Mapping[str, str]) -> None:
        """`another` makes an estimator of the same configuration and aircraft; `chosen` are choices that stay."""
        self.counts = Snapshots()
        self._estimator, self._another, self._chosen = estimator, another, chosen
        self._held: Frames | None = None
        self._started = self._known = False
        self.first_us = 0
        """Recorded time of the first frame of the log [us]."""
        self._base = codec.message("BASE_SAMPLE").frame_id
        self._time_of = codec.raw_field("BASE_SAMPLE", "time_us")

    def pieces(self, frames: Frames, last: bool = False) -> Iterator[tuple[Frames, Snapshot | None]]:
        """Yield the frames to feed, in pieces; some are held back until the next call, or the `last`.

        The estimator has the state of the snapshot, if there is one, after its piece.
        """
        held = frames if self._held is None else np.concatenate((self._held, frames))
        self._held = held
        found = snapshots.find(held)
        if not (self._started or last or self._may_start(held, found)):
            return
        places = [self._place(held, each) for each in found]
        done = len(held) if last else self._end_of_certain(held, found, places)
        begun = 0 if self._started else self._start(held, found, places)
        self._started = True
        yield from self._cut(held, begun, max(done, begun), list(zip(found, places, strict=True)), last)
        self._held = held[max(done, begun) :].copy()

    def compare(self, snapshot: Snapshot, recorded_us: int) -> None:
        """After the piece of the snapshot, whose last frame was recorded then."""
        self.counts.found += 1
        if snapshot.digest is None:
            self.counts.broken += 1
            return
        if not self._is_comparable(snapshot):
            return
        seconds = (recorded_us - self.first_us) * 1e-6
        if zlib.crc32(self._estimator.state()) == snapshot.digest:
            self.counts.equal += 1
            self.counts.last_equal_s = seconds
            return
        self.counts.different += 1
        if self.counts.first_different_s is None:
            self.counts.first_different_s = seconds
        if snapshot.state is not None:
            self._estimator.restore(snapshot.state)

    def summary(self) -> Snapshots | None:
        """None without a snapshot."""
        return self.counts if self.counts.found else None

    # --- where to cut -------------------------------------------------------------------------------------------------

    def _may_start(self, held: Frames, found: list[Snapshot]) -> bool:
        """Return whether the first whole snapshot is there, or there will be none."""
        samples = held["time_us"][held["id"] == self._base]  # a COMMAND may be of long before
        span = abs(int(samples[-1] - samples[0])) if len(samples) else 0
        silent = not (held["id"] == codec.message(snapshots.NAME).frame_id).any()
        return any(each.state for each in found) or span > (_SILENT_US if silent else _LONGEST_US)

    def _place(self, held: Frames, snapshot: Snapshot) -> int | None:
        """Return the place of the last BASE_SAMPLE of its sample before it."""
        before = np.flatnonzero(held["id"][: snapshot.begin] == self._base)[-_SAMPLES_LATE:]
        for place in before[::-1]:
            if self._time_of(held["data"][place].tobytes()) == snapshot.time_us:
                return int(place)
        return None

    def _end_of_certain(self, held: Frames, found: list[Snapshot], places: list[int | None]) -> int:
        """Return the place before which no frame belongs to a snapshot that is still to come."""
        if found and not found[-1].ended:
            begin = found[-1].begin
            if abs(held["time_us"][-1] - held["time_us"][begin]) < _LONGEST_US:
                place = places[-1]
                return begin if place is None else place
        samples = np.flatnonzero(held["id"] == self._base)[-_SAMPLES_LATE:]
        return int(samples[0]) if len(samples) else 0

    def _start(self, held: Frames, found: list[Snapshot], places: list[int | None]) -> int:
        """Return where to begin.

        That is with the log, or after the sample of the first whole snapshot, if the log is not of the flight from its
        start.
        """
        for snapshot, place in zip(found, places, strict=True):
            if snapshot.state is None or place is None or not self._is_comparable(snapshot):
                continue
            trial = self._another()
            for _ in Feeder(trial).feed(held[: place + 1]):
                pass
            if zlib.crc32(trial.state()) != snapshot.digest and self._estimator.restore(snapshot.state):
                self.counts.begun_at_s = (int(held["time_us"][place]) - self.first_us) * 1e-6
                self.counts.left_out = place + 1
                self.counts.found += 1
                return place + 1
            break
        return 0

    def _cut(
        self, held: Frames, begun: int, done: int, found: list[tuple[Snapshot, int | None]], last: bool
    ) -> Iterator[tuple[Frames, Snapshot | None]]:
        for snapshot, place in found:
            if place is None or not snapshot.ended:
                under_way = last and snapshot.begin == found[-1][0].begin
                if begun <= snapshot.begin < done and not under_way:
                    self.counts.found += 1
                    self.counts.broken += 1
            elif begun <= place < done:
                yield held[begun : place + 1], snapshot
                begun = place + 1
        if begun < done:
            yield held[begun:done], None

    def _is_comparable(self, snapshot: Snapshot) -> bool:
        """Decided by the first of which there is all; before that presumed."""
        if not self._known and self.counts.not_compared is None and snapshot.state is not None:
            self._known = True
            if snapshot.layout != state_layout():
                self.counts.not_compared = "they are of another version of the firmware"
            else:
                trial = self._another()
                if not trial.restore(snapshot.state):
                    self.counts.not_compared = "they are of other settings, or only one of both has an aircraft"
                elif any(choices_of(trial)[what] != name for what, name in self._chosen.items()):
                    self.counts.not_compared = OTHER_CHOICES
        return self.counts.not_compared is None


def choices_of(estimator: Estimator) -> dict[str, str]:
    """As they stand, by its answer to a COMMAND that keeps them; the estimator is of no other use then."""
    estimator.on_frame(codec.message("COMMAND").frame_id, codec.encode("COMMAND", 0, {"request": "none", **KEEP}))
    answer = estimator.next_frame()
    assert answer is not None
    _, fields = codec.decode(*answer)
    return {what: enum_names(f"lever_{what}")[int(fields[what])] for what in CHOICES}


def in_words(counts: Snapshots | None) -> str:
    """Return a sentence or two for the verdict."""
    if counts is None:
        return ""
    if counts.not_compared is not None:
        return f"Its {counts.found} snapshots of the state are not compared: {counts.not_compared}."
    sentences = []
    if counts.begun_at_s is not None:
        sentences.append(
            f"The log does not begin where the estimator did: replayed from the snapshot {counts.begun_at_s:.3f} s "
            f"after its beginning ({counts.left_out:,} frames left out)."
        )
    compared = counts.equal + counts.different
    if counts.different:
        sentences.append(
            f"The state is not the recorded one at {counts.different} of {compared} snapshots, first at "
            f"{counts.first_different_s:.3f} s: between it and the snapshot before, the log is not what the estimator "
            "received. From each of them the replay goes on with the recorded state."
        )
    elif compared:
        sentences.append(
            f"The state is the recorded one to the bit at all of {compared} snapshots, to {counts.last_equal_s:.3f} s."
        )
    if counts.broken:
        sentences.append(f"{counts.broken} snapshots are not whole.")
    return " ".join(sentences)
