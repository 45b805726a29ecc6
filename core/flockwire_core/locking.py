"""Locks on files, which the system releases when their holder ends; on file systems with and without locks.

On NFS an exclusive lock needs a file that is open for writing; some file systems have no locks at all. There nothing is
locked: no order waits for a lock.
"""

from __future__ import annotations

import fcntl
import os
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO

EXCLUSIVE, SHARED, NOW = fcntl.LOCK_EX, fcntl.LOCK_SH, fcntl.LOCK_NB


def lock(file: BinaryIO, how: int) -> bool:
    """Lock `file` as `how` (EXCLUSIVE or SHARED, with NOW without waiting); False if there are no locks here.

    Raises BlockingIOError if another holds it.
    """
    try:
        fcntl.flock(file, how)
    except BlockingIOError:
        raise
    except OSError:
        return False
    return True


def opened(path: Path) -> BinaryIO:
    """Return `path` opened for a lock: for writing, if that is allowed. Raises OSError."""
    with suppress(PermissionError):
        return os.fdopen(os.open(path, os.O_RDWR), "r+b", buffering=0)
    return path.open("rb", buffering=0)


def is_held(file: BinaryIO) -> bool | None:
    """Return whether another holds a shared lock on `file`; None if there are no locks here.

    If nobody holds one, `file` may then be locked exclusively. An exclusive lock is that of another call, for a moment:
    while it lasts, no shared one is held.
    """
    for _ in range(3):  # another call's shared lock below lasts for a moment
        with suppress(BlockingIOError):
            return False if lock(file, EXCLUSIVE | NOW) else None
        with suppress(BlockingIOError):
            lock(file, SHARED | NOW)
            fcntl.flock(file, fcntl.LOCK_UN)
            continue
        return False
    return True
