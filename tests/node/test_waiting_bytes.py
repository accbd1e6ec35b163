"""What waits in a line is read whole, what it hands on a moment later too, and none is waited for in vain."""

from __future__ import annotations

import array
import fcntl
import os
import termios
import threading
import tty
from collections.abc import Iterator

import pytest

from node.process.drivers.waiting_bytes import CHUNK, PORTION, read_waiting

PATIENCE = 10.0  # s, which no test waits for


@pytest.fixture
def line() -> Iterator[tuple[int, int]]:
    """Both ends of a serial line, of which the second never blocks."""
    one, other = os.openpty()
    tty.setraw(other)
    os.set_blocking(other, False)
    yield one, other
    os.close(one)
    os.close(other)


@pytest.mark.parametrize("size", [PORTION, 4095, 4096, 6136])
def test_a_line_is_read_whole_and_in_order(line: tuple[int, int], size: int) -> None:
    one, other = line
    data = bytes(k % 251 for k in range(size))
    os.write(one, data)
    got = b""
    while len(got) < size:  # the line hands on after the write, too
        got += read_waiting(other)
    assert got == data


def test_what_follows_a_portion_is_read_with_it() -> None:
    """The rest is written once the first portion has been taken out, as a line does."""
    reader, writer = os.pipe2(os.O_NONBLOCK)
    first, rest = b"a" * PORTION, b"b" * 500
    os.write(writer, first)

    def hand_on() -> None:
        poll_empty(reader)
        os.write(writer, rest)

    follower = threading.Thread(target=hand_on)
    follower.start()
    assert read_waiting(reader, PATIENCE) == first + rest
    follower.join()
    os.close(reader)
    os.close(writer)


def test_less_than_a_portion_is_waited_for_by_none() -> None:
    reader, writer = os.pipe2(os.O_NONBLOCK)
    assert read_waiting(reader, PATIENCE) == b""
    os.write(writer, b"a" * (PORTION - 1))
    assert read_waiting(reader, PATIENCE) == b"a" * (PORTION - 1)
    os.close(writer)
    assert read_waiting(reader, PATIENCE) == b""
    os.close(reader)


def test_more_than_one_read_takes_is_read() -> None:
    reader, writer = os.pipe2(os.O_NONBLOCK)
    size = os.write(writer, b"c" * (2 * CHUNK))
    assert read_waiting(reader) == b"c" * size
    os.close(writer)
    os.close(reader)


def poll_empty(file: int) -> None:
    """Return once nothing waits in a file."""
    waiting = array.array("i", [1])
    while waiting[0]:
        fcntl.ioctl(file, termios.FIONREAD, waiting)
