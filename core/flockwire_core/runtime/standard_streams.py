"""Standard output and error that may be gone or blocked: no flight ends, and no loop waits, because of them.

With a full disk or a lost reader the text is lost; this is reported once, at the end of the command. Where a loop
runs, a thread writes: a paused terminal, or a pipe without a reader, blocks only this thread. MOST pieces of text
wait for it; the lines after these are dropped, and their number is written when it can write again.
"""

from __future__ import annotations

import contextlib
import errno
import io
import os
import sys
import threading
import traceback
from collections.abc import Callable, Iterator
from functools import partial
from queue import Queue
from typing import TYPE_CHECKING, TextIO

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer

LOST = "flockwire: the standard output could not be written: "
DROPPED = "flockwire: lines dropped while this terminal, or the reader of this output, was paused: {count}\n"
MOST = 1000  # pieces of text (lines of a log) that wait for a paused terminal


class UnblockedStream(io.FileIO):
    """Writes to the file descriptor `fd`; the first error is kept in `error`, and later text is lost."""

    def __init__(self, fd: int) -> None:
        super().__init__(fd, "w", closefd=False)
        self.error: OSError | None = None
        self._fd = fd  # for the thread, also when this is closed
        self._lock = threading.Lock()
        self._waiting = self._dropped = 0  # pieces in the thread, and lines lost since it has been full

    def seekable(self) -> bool:
        """Return that no position can be set: the thread writes later."""
        return False

    def write(self, data: ReadableBuffer, /) -> int:
        """Write all of `data`, directly or by the thread, or drop it."""
        taken = bytes(data)
        with self._lock:
            full = self._waiting >= MOST or self._dropped > 0
            if full:
                self._dropped += taken.count(b"\n")
            else:
                self._waiting += 1
        if not full:
            later(partial(self._pass_on, taken))
        return len(taken)

    def _pass_on(self, data: bytes) -> None:
        """Write `data`, and then how many lines were dropped if nothing else waits, without a time limit."""
        self._write_out(data)
        with self._lock:
            self._waiting -= 1
            dropped = 0 if self._waiting else self._dropped
            self._dropped -= dropped
        if dropped:
            self._write_out(DROPPED.format(count=dropped).encode())

    def _write_out(self, data: bytes) -> None:
        try:
            while data and self.error is None:
                data = data[os.write(self._fd, data) :]
        except OSError as error:
            self.error = error


class WritingThread:
    """A thread that writes and draws one after the other."""

    def __init__(self) -> None:
        self._work = Queue[Callable[[], None] | None]()  # None: no more comes
        self._thread = threading.Thread(target=self._write, daemon=True)  # a blocked one keeps no process
        self._thread.start()

    @property
    def busy(self) -> bool:
        """Whether work is pending, or in progress."""
        return self._work.unfinished_tasks > 0

    def take(self, work: Callable[[], None]) -> None:
        """Do `work` after all other."""
        self._work.put(work)

    def end(self, patience: float | None) -> None:
        """Wait until all is done, at most `patience` s."""
        self._work.put(None)
        self._thread.join(patience)

    def _write(self) -> None:
        for work in iter(self._work.get, None):
            try:
                work()
            except Exception:
                traceback.print_exc()  # a failed table does not end a flight
            self._work.task_done()


_writer: WritingThread | None = None  # while a loop runs


def busy() -> bool:
    """Return whether text still waits for the terminal or the reader."""
    return _writer is not None and _writer.busy


def later(work: Callable[[], None]) -> None:
    """Do `work`, which prints, in the writing thread, or directly if there is none."""
    if _writer is None:
        work()
    else:
        _writer.take(work)


@contextlib.contextmanager
def unblocked(patience: float | None = None) -> Iterator[None]:
    """Do not wait for the terminal or a reader during the context; wait at its end, at most `patience` s."""
    global _writer  # noqa: PLW0603  (one process, one standard output)
    _writer = WritingThread()
    try:
        yield
    finally:
        ending, _writer = _writer, None
        ending.end(patience)


@contextlib.contextmanager
def tolerant() -> Iterator[list[OSError]]:
    """Replace the standard streams by tolerant ones; after it the list has the standard output's error, if any.

    A stream without a file (in tests) is not replaced.
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
    """Print that the standard output failed; returns the exit status of an otherwise successful command.

    A reader that ends early (`| head`) is not a failure.
    """
    print(f"{LOST}{error.strerror}", file=sys.stderr)
    return 0 if error.errno == errno.EPIPE else 1


def _replaced(stream: TextIO, original: TextIO | None) -> tuple[TextIO, UnblockedStream | None]:
    if stream is not original or not isinstance(stream, io.TextIOWrapper):
        return stream, None
    outlet = UnblockedStream(stream.fileno())
    buffer = io.BufferedWriter(outlet)
    at_once = stream.line_buffering or stream.write_through  # the latter with PYTHONUNBUFFERED
    wrapped = io.TextIOWrapper(buffer, stream.encoding, stream.errors, line_buffering=at_once)
    return wrapped, outlet
