"""Standard output and error that may be gone or stand still: no flight ends, and no loop waits, because of them.

A disk that is full and a reader that has left cost the text, and are reported once, at the end of the command. While a
swarm flies, a thread writes: a terminal that is paused, or a pipe that nobody reads, holds the thread alone.
"""

from __future__ import annotations

import contextlib
import errno
import io
import os
import sys
import threading
import traceback
from collections import deque
from collections.abc import Callable, Iterator
from functools import partial
from typing import TYPE_CHECKING, TextIO

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer

LOST = "flockwire: the standard output could not be written: "


class UnblockedStream(io.RawIOBase):
    """Writes to the file descriptor `fd`; the first error is kept in `error`, and what follows it is lost."""

    def __init__(self, fd: int) -> None:
        self.error: OSError | None = None
        self._fd = fd

    def fileno(self) -> int:
        """Return the file descriptor."""
        return self._fd

    def isatty(self) -> bool:
        """Return whether this is a terminal."""
        return os.isatty(self._fd)

    def writable(self) -> bool:
        """Return that it can be written to."""
        return True

    def write(self, data: ReadableBuffer, /) -> int:
        """Take all of `data`: at once, or for the thread to write."""
        taken = bytes(data)
        if _writer is None:
            self.pass_on(taken)
        else:
            _writer.take(partial(self.pass_on, taken))
        return len(taken)

    def pass_on(self, data: bytes) -> None:
        """Write `data`, however long that takes."""
        try:
            while data and self.error is None:
                data = data[os.write(self._fd, data) :]
        except OSError as error:
            self.error = error


class WritingThread:
    """A thread that writes, and draws, one thing after the other."""

    def __init__(self) -> None:
        self._taken: deque[Callable[[], None]] = deque()  # the first one is under way
        self._changed = threading.Condition()
        self._over = False
        self._thread = threading.Thread(target=self._write, daemon=True)  # one that is held does not keep the process
        self._thread.start()

    @property
    def busy(self) -> bool:
        """Whether something is left to do."""
        return bool(self._taken)

    def take(self, work: Callable[[], None]) -> None:
        """Do `work` after all else."""
        with self._changed:
            self._taken.append(work)
            self._changed.notify()

    def end(self) -> None:
        """Wait until all is done, however long that takes."""
        with self._changed:
            self._over = True
            self._changed.notify()
        self._thread.join()

    def _write(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._taken or self._over)
                if not self._taken:
                    return
            try:
                self._taken[0]()
            except Exception:
                traceback.print_exc()  # a table that cannot be drawn ends no flight
            self._taken.popleft()


_writer: WritingThread | None = None  # while a swarm flies


def busy() -> bool:
    """Return whether the terminal, or who reads, has not taken yet what was written while a swarm flies."""
    return _writer is not None and _writer.busy


def later(work: Callable[[], None]) -> None:
    """Do `work`, which prints, in the thread that writes, or at once where there is none."""
    if _writer is None:
        work()
    else:
        _writer.take(work)


@contextlib.contextmanager
def unblocked() -> Iterator[None]:
    """Wait for no terminal and no reader for as long as the context lasts; wait at its end until all is written."""
    global _writer  # noqa: PLW0603  (one process, one standard output)
    _writer = WritingThread()
    try:
        yield
    finally:
        ending, _writer = _writer, None
        ending.end()


@contextlib.contextmanager
def tolerant() -> Iterator[list[OSError]]:
    """Replace the standard streams by tolerant ones; after it the list has the standard output's error, if any.

    What is no file (a test's) is left as it is.
    """
    before, errors = (sys.stdout, sys.stderr), list[OSError]()
    sys.stdout, out = _replaced(sys.stdout, sys.__stdout__)
    sys.stderr, _ = _replaced(sys.stderr, sys.__stderr__)
    try:
        yield errors
    finally:
        for stream in (sys.stdout, sys.stderr):
            if stream is not None:
                stream.flush()
        sys.stdout, sys.stderr = before
        if out is not None and out.error is not None:
            errors.append(out.error)


def report(error: OSError) -> int:
    """Print that the standard output failed; returns the exit status of a command that went well otherwise.

    A reader that leaves early has what it wants (`| head`).
    """
    print(f"{LOST}{error.strerror}", file=sys.stderr)
    return 0 if error.errno == errno.EPIPE else 1


def _replaced(stream: TextIO, original: TextIO | None) -> tuple[TextIO, UnblockedStream | None]:
    if stream is not original or not isinstance(stream, io.TextIOWrapper):
        return stream, None
    outlet = UnblockedStream(stream.fileno())
    buffer = io.BufferedWriter(outlet)
    wrapped = io.TextIOWrapper(buffer, stream.encoding, stream.errors, line_buffering=stream.line_buffering)
    return wrapped, outlet
