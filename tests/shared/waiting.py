"""Waits, with a deadline, for what no event announces: a socket, another process, a file."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")
SOON = 10.0  # s; on an idle machine it is a matter of milliseconds
PERIOD = 0.005  # s between two looks


async def until(met: Callable[[], T], seconds: float = SOON) -> T:
    """Let the loop run until `met()` is true and return that; raises TimeoutError after `seconds`."""
    async with asyncio.timeout(seconds):
        while not (found := met()):  # noqa: ASYNC110  (no event announces it)
            await asyncio.sleep(PERIOD)
    return found


def wait_until(met: Callable[[], T], seconds: float = SOON) -> T:
    """Wait until `met()` is true and return that; raises TimeoutError after `seconds`."""
    deadline = time.monotonic() + seconds
    while not (found := met()):
        if time.monotonic() > deadline:
            raise TimeoutError(f"not so within {seconds} s")
        time.sleep(PERIOD)
    return found
