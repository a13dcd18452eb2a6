"""COMMAND frames of one sender: they have one counter, whose sequence the estimator checks, and are acknowledged."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Mapping

from . import codec

KEEP: dict[str, codec.Value] = {
    "model": "keep",
    "preload": "keep",
    "estimator": "keep",
    "adaptation": "keep",
    "mitigation": "keep",
    "dither_rms": math.inf,
}
"""A COMMAND that changes nothing; infinity saturates at the value that keeps the dither."""

KEEP_ALIVE = 0.25
"""[s] after which to repeat a COMMAND, so that torque and correction go on: the estimator waits for a second."""

ACCEPTED, SEQUENCE = "accepted", "sequence"
UNANSWERED = "no COMMAND_ACK: is an estimator, of this version, on the bus?"
"""Why a COMMAND has done nothing."""
_REFUSALS = {
    "unknown_value": "it does not know a value in it",
    SEQUENCE: "its counter is out of sequence: is there another sender of COMMAND?",
    "fault_mode": "it is in mode fault, which only a reset leaves",
    "disabled": "its image was built without -D LEVER_COMMANDS=ON, so no COMMAND may change anything",
    "acting": "while torque or a correction acts on the lever, all that a COMMAND may change is to end the dither",
    "not_safe": "its machine says that it is not safe now",
    "not_authentic": "no authentication came with it, or not a new one of its sender",
}


class Commander:
    """Makes them, in any thread."""

    def __init__(self) -> None:
        self._counter = 0
        self._lock = threading.Lock()

    def send(self, values: Mapping[str, codec.Value], put: Callable[[int, bytes], None]) -> int:
        """Send a COMMAND that changes only `values`.

        Parameters
        ----------
        values
            Fields of COMMAND by name, in the units of lever.dbc.
        put
            What sends a frame, given its identifier and data.

        Returns
        -------
        int
            Its counter, 0 to 15, which the COMMAND_ACK repeats.

        Raises
        ------
        CodecError
            A field is unknown, or cannot hold its value.
        """
        with self._lock:
            counter = self._counter
            data = codec.encode("COMMAND", counter, {"request": "none", **KEEP, **values})
            self._counter = (counter + 1) & 15
            put(codec.message("COMMAND").frame_id, data)
            return counter


def result_of(ack: Mapping[str, float]) -> str:
    """Return what became of a COMMAND.

    Parameters
    ----------
    ack
        The fields of its COMMAND_ACK.

    Returns
    -------
    str
        ACCEPTED, SEQUENCE or another result of lever.dbc.
    """
    number = int(ack["result"])
    return codec.choices("COMMAND_ACK", "result").get(number, f"result {number}")


def refusal(result: str) -> str:
    """Return why a COMMAND was refused, in words."""
    return f"the estimator refuses COMMAND: {_REFUSALS.get(result, result)}"
