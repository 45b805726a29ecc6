"""How long the machine gives its cores to others: a process that wakes every 2 ms on each core, and notes how late."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import time
from collections.abc import Iterator
from typing import Any

NAP = 0.002  # s


def watch(core: int, worst: Any) -> None:  # noqa: ANN401  (shared memory)
    """Keep in `worst` by how many s this process woke too late on `core`, at most."""
    os.sched_setaffinity(0, {core})
    last = time.monotonic()
    while True:
        time.sleep(NAP)
        now = time.monotonic()
        worst.value = max(worst.value, now - last - NAP)
        last = now


class TakenCores:
    """What the watching processes saw since `reset`."""

    def __init__(self, seen: list[Any]) -> None:
        self._seen = seen

    def reset(self) -> None:
        """Reset all values."""
        for worst in self._seen:
            worst.value = 0.0

    def longest(self) -> float:
        """Return for how many s a core was taken away at most."""
        return max(float(worst.value) for worst in self._seen)


@contextlib.contextmanager
def taken_cores() -> Iterator[TakenCores]:
    """Watch all cores for as long as the context lasts."""
    context = multiprocessing.get_context("spawn")
    cores = sorted(os.sched_getaffinity(0))
    seen = [context.Value("d", 0.0) for _ in cores]
    processes = [context.Process(target=watch, args=(core, worst)) for core, worst in zip(cores, seen, strict=True)]
    for process in processes:
        process.start()
    try:
        yield TakenCores(seen)
    finally:
        for process in processes:
            process.kill()
            process.join()
