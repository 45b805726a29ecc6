"""Detects keys in use on this machine: every session locks those of its folder.

The authority of keys in use may not be replaced. The lock is a shared lock on the authority's certificate; the system
releases it when the process ends.
"""

from __future__ import annotations

import fcntl
from pathlib import Path
from typing import BinaryIO

HELD = "ca.crt"


def hold(folder: Path) -> BinaryIO | None:
    """Lock the keys in `folder` until the returned file is closed.

    Returns None if the file system has no locks: no order waits for one.
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
    """Return whether a process of this machine, also in a container, has locked the keys in `folder`."""
    try:
        with (folder / HELD).open("rb") as held:
            fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return False
    return False
