"""Frames at a rate: what feeds the trackers' twins."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable
from itertools import count

from flockwire_core import clock
from flockwire_core.domain.time import SECOND
from flockwire_mocap.tracking import TrackerFrame


async def stream(frames: Iterable[TrackerFrame], rate_hz: float, publish: Callable[[TrackerFrame], None]) -> None:
    """Take the frames one by one at the times they are due, `rate_hz` in a second, and publish each at once.

    A frame that is late is taken and published without delay; none is left out.
    """
    begin, source = clock.monotonic(), iter(frames)
    for number in count():
        await asyncio.sleep(max(0.0, number / rate_hz - (clock.monotonic() - begin) / SECOND))
        frame = next(source, None)
        if frame is None:
            return
        publish(frame)
