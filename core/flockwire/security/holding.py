"""Whether keys are in use on this machine: every session holds those of its folder.

Nobody may replace their authority then. It is a shared lock on the authority's certificate, which the system releases
when the process ends.
"""

from __future__ import annotations

import fcntl
from pathlib import Path
from typing import BinaryIO

HELD = "ca.crt"


def hold(folder: Path) -> BinaryIO | None:
    """Hold the keys in `folder` until the file that is returned is closed.

    None if the file system has no locks: no order waits for one.
    """
    try:
        held = (folder / HELD).open("rb")
    except OSError:
        return None
    try:
        fcntl.flock(held, fcntl.LOCK_SH)
    except OSError:
        held.close()
        return None
    return held


def in_use(folder: Path) -> bool:
    """Return whether a process of this machine, a container's too, holds the keys in `folder`."""
    try:
        with (folder / HELD).open("rb") as held:
            fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return False
    return False
