"""Opens a session for an operator; shows the wait for the router, which may be interrupted."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

from flockwire_core.runtime.session import Session, connect
from flockwire_core.wire.plan import Plan

from flockwire_operator.station.terminal.interrupts import Interrupts

UNANSWERED = "interrupted before the router answered"


async def connected(
    plan: Plan, identity: str, keys: Path, interrupted: Interrupts, hopeless: Callable[[], object] = bool
) -> Session | None:
    """Return the session of `identity`; None if interrupted, or `hopeless`, before the router answered.

    Raises CredentialsError.
    """
    ended = asyncio.Event()
    note = partial(print, "flockwire:", file=sys.stderr, flush=True)
    opening = asyncio.create_task(connect(plan, identity, keys, ended, note=note))
    try:
        while not opening.done():
            if interrupted.count or hopeless():
                ended.set()
            await asyncio.wait((opening,), timeout=0.05)
    except asyncio.CancelledError:  # the thread that opens the session continues; an open session blocks the exit
        ended.set()
        if (session := await opening) is not None:
            session.close()
        raise
    return opening.result()
