"""Who handles a key that arrives: Zenoh's thread, or the loop when that thread would wait or is behind; batches."""

from __future__ import annotations

import asyncio
import ctypes
import threading
from types import SimpleNamespace

import pytest
from flockwire_core import clock
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.runtime.samples import BEHIND, Prompt, Publishing, Wakeup
from flockwire_core.wire.batch import PERIOD
from flockwire_core.wire.codec import encode
from flockwire_core.wire.inbox import Inbox, attachment
from flockwire_core.wire.keys import BATCH, MISSION, Key

T0 = 1_700_000_000 * SECOND
POSE, BATCHED = Key("pose", "uav1"), Key(BATCH, "gateway")
SESSION = b"0123456789ab"
APART = 5 * BEHIND  # ns between two poses of a process that is not behind


class Bytes(bytes):
    """Stands for Zenoh's."""

    def to_bytes(self) -> bytes:
        return bytes(self)


class Bench:
    """A subscription to poses: which thread handled it, and at which height the pose then was."""

    def __init__(self, direct: bool = True) -> None:
        self.handled: list[tuple[bool, float | None]] = []  # on the loop's thread?, height
        self.error: Exception | None = None
        self.lock = threading.Lock()
        self.wakeup = Wakeup(self._handle, self.lock)
        self.wakeup.direct = direct
        self.prompt = Prompt(Inbox(POSE), self.wakeup)
        self._loop, self._sequence = threading.get_ident(), 0

    def _handle(self, prompt: Prompt) -> None:
        assert self.lock.locked()
        message = prompt.message(clock.now())
        height = message.position[2] if isinstance(message, Pose) else None
        self.handled.append((threading.get_ident() == self._loop, height))
        if self.error is not None:
            raise self.error

    def _arrive(self, heights: tuple[float, ...]) -> None:
        for height in heights:
            now = clock.now()
            payload = encode(Pose(now, "world", (0.0, 0.0, height)))
            attached = attachment(self._sequence, now, SESSION, POSE)
            self._sequence += 1
            self.prompt.arrived(SimpleNamespace(payload=Bytes(payload), attachment=Bytes(attached)))

    def arrive(self, *heights: float) -> None:
        """Have poses arrive on a thread that stands for Zenoh's, and wait for that alone."""
        thread = threading.Thread(target=self._arrive, args=(heights,))
        thread.start()
        thread.join()


def test_zenohs_thread_handles_what_arrives_when_direct_and_the_loop_when_not():
    async def handled(direct: bool) -> list[tuple[bool, float | None]]:
        bench = Bench(direct)
        bench.arrive(1.0)
        at_once = [*bench.handled]
        await asyncio.sleep(0.01)
        assert bool(at_once) is direct
        return bench.handled

    assert asyncio.run(handled(True)) == [(False, 1.0)]
    assert asyncio.run(handled(False)) == [(True, 1.0)]


def test_what_python_has_of_each_thread_of_zenoh_is_kept_also_with_the_number_of_one_that_has_ended(monkeypatch):
    async def kept() -> int:
        bench, calls = Bench(), []
        monkeypatch.setattr(ctypes, "pythonapi", SimpleNamespace(PyGILState_Ensure=lambda: calls.append(1)))
        for _ in range(5):
            bench.arrive(1.0, 2.0)
        return len(calls)

    assert asyncio.run(kept()) == 5


def test_zenohs_thread_never_waits_for_the_lock():
    async def handled() -> list[tuple[bool, float | None]]:
        bench = Bench()
        with bench.lock:
            bench.arrive(1.0)
            assert not bench.handled
        await asyncio.sleep(0.01)
        return bench.handled

    assert asyncio.run(handled()) == [(True, 1.0)]


def test_a_process_that_is_behind_skips_to_the_newest():
    async def handled() -> list[tuple[bool, float | None]]:
        bench = Bench()
        bench.arrive(1.0, 2.0, 3.0, 4.0)
        await asyncio.sleep(0.01)
        bench.arrive(5.0)
        return bench.handled

    assert asyncio.run(handled()) == [(False, 1.0), (True, 4.0), (False, 5.0)]


def test_an_error_is_the_loops_to_report_and_the_lock_is_free_again():
    async def reported() -> list[Exception]:
        bench, errors = Bench(), []
        asyncio.get_running_loop().set_exception_handler(lambda _, context: errors.append(context["exception"]))
        bench.error = ValueError("a bad core")
        bench.arrive(1.0)
        await asyncio.sleep(APART / 1e9)
        bench.arrive(2.0)
        await asyncio.sleep(0.01)
        assert bench.handled == [(False, 1.0), (False, 2.0)]
        return errors

    assert [str(error) for error in asyncio.run(reported())] == ["a bad core"] * 2


def test_an_error_of_one_key_holds_up_no_other():
    async def handled() -> None:
        errors: list[object] = []
        asyncio.get_running_loop().set_exception_handler(lambda _, context: errors.append(context["exception"]))
        calls: list[Prompt] = []

        def handle(prompt: Prompt) -> None:
            calls.append(prompt)
            if len(calls) == 1:
                raise ValueError("a bad core")

        wakeup = Wakeup(handle, threading.Lock())
        first, second = Prompt(Inbox(POSE), wakeup), Prompt(Inbox(MISSION), wakeup)
        first.arrived(SimpleNamespace())
        second.arrived(SimpleNamespace())
        await asyncio.sleep(0.01)
        assert [str(error) for error in errors] == ["a bad core"]
        assert calls == [first, second]

    asyncio.run(handled())


def test_of_a_key_of_which_each_message_counts_each_is_announced():
    async def announced() -> int:
        calls: list[Prompt] = []
        wakeup = Wakeup(calls.append, threading.Lock())
        prompt = Prompt(Inbox(MISSION), wakeup)
        for _ in range(3):
            prompt.arrived(SimpleNamespace())
        await asyncio.sleep(0.01)
        return len(calls)

    assert asyncio.run(announced()) == 3


def test_a_loop_that_is_closed_is_left_alone():
    async def made() -> Bench:
        return Bench(direct=False)

    bench = asyncio.run(made())
    bench.arrive(1.0)
    with pytest.raises(RuntimeError):
        asyncio.get_running_loop()
    assert not bench.handled


@pytest.mark.sources  # replaces compiled functions
def test_a_batch_that_is_due_waits_where_its_sender_is_called_apart_from_what_is_urgent(monkeypatch, make_plan):
    now, sent = T0, []

    class Publisher:
        def __init__(self, key):
            self.key = key

        def put(self, payload, attachment):
            sent.append(self.key)

    monkeypatch.setattr(clock, "now", lambda: now)
    publishing = Publishing(make_plan(), "gateway", b"p" * 16, lambda key: (Publisher(key),))
    for now in (T0, T0 + PERIOD):
        publishing.publish([(POSE, Pose(now, "world", (0.0, 0.0, 1.0)))])
    assert sent == [POSE, POSE, BATCHED]
