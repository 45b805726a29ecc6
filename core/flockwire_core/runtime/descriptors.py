"""File descriptors enough that connections without any key do not take the last one.

The sessions for processes and for operators share the descriptors of a process. The usual soft limit of 1024 can be
taken by one peer; the hard limit is 20 to 1000 times as high.
"""

from __future__ import annotations

import contextlib
import resource

MOST = 65536  # of one process; 6 KB of memory for each connection


def raise_limit() -> None:
    """Raise the soft limit of this process, and of its children, to the hard one, but to MOST at most."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = MOST if hard == resource.RLIM_INFINITY else min(hard, MOST)
    if soft == resource.RLIM_INFINITY or soft >= wanted:
        return
    with contextlib.suppress(OSError, ValueError):  # macOS has a lower limit of its own
        resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))
