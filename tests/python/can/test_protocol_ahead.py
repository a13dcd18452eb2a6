"""Serial ports that read ahead give what pyserial's own give."""

from __future__ import annotations

import os
import socket
import time
import tty
from collections.abc import Iterator

import pytest
import serial
from lever_cdkf.can.protocol_ahead import read_ahead
from processes import PATIENCE


@pytest.fixture
def line() -> Iterator[tuple[int, str]]:
    """Yield a pseudo-terminal: the end to write to, and the path of the other."""
    end, other = os.openpty()
    tty.setraw(other)
    yield end, os.ttyname(other)
    os.close(other)
    os.close(end)


def test_bytes_come_in_order_and_in_the_pieces_asked_for(line: tuple[int, str]) -> None:
    end, path = line
    with serial.serial_for_url(read_ahead(path), timeout=1.0) as port:
        os.write(end, b"abcdefgh")
        assert [port.read(), port.read(2), port.read(3)] == [b"a", b"bc", b"def"]
        assert port.in_waiting == 2
        os.write(end, b"ijk")
        assert port.read(5) == b"ghijk"


def test_it_waits_for_what_is_missing_and_no_longer_than_the_timeout(line: tuple[int, str]) -> None:
    end, path = line
    with serial.serial_for_url(read_ahead(path), timeout=0.1) as port:
        os.write(end, b"ab")
        began = time.monotonic()
        assert port.read(3) == b"ab"
        assert 0.1 <= time.monotonic() - began < PATIENCE
        port.timeout = 0.0
        assert port.read(1) == b""


def test_resetting_forgets_what_was_read_ahead(line: tuple[int, str]) -> None:
    end, path = line
    with serial.serial_for_url(read_ahead(path), timeout=0.5) as port:
        os.write(end, b"old")
        assert port.read(1) == b"o"
        port.reset_input_buffer()
        assert port.in_waiting == 0
        os.write(end, b"new")
        assert port.read(3) == b"new"
        port.write(b"back")
        assert os.read(end, 100) == b"back"


def test_over_a_socket_until_the_other_end_closes() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        url = f"socket://127.0.0.1:{server.getsockname()[1]}"
        with serial.serial_for_url(read_ahead(url), timeout=1.0) as port:
            there, _ = server.accept()
            with there:
                there.sendall(b"xyz")
                assert port.read(3) == b"xyz"
            with pytest.raises(serial.SerialException, match="the other end of the line is gone"):
                port.read(1)


def test_elsewhere_than_on_posix_a_channel_stays_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patched:
        patched.setattr(os, "name", "nt")
        channel = read_ahead("COM3")
    assert channel == "COM3"


def test_a_port_that_is_not_there_is_named_without_the_scheme() -> None:
    with pytest.raises(serial.SerialException, match="could not open port /dev/no_such_port"):
        serial.serial_for_url(read_ahead("/dev/no_such_port"))
