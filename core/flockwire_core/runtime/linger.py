"""Prevents a silent peer from freezing this process: closing a socket must not wait for the peer.

Zenoh gives every TCP and TLS link a linger time of 10 s (SO_LINGER), which cannot be configured. When it closes the
link of a silent peer, close() then waits in the kernel for this time, and with it the thread of all other messages
(eclipse-zenoh/zenoh issues 1101 and 2350). On Linux a seccomp filter makes that one setsockopt succeed without effect;
elsewhere nothing is done: BSD does not linger on non-blocking sockets.
"""

from __future__ import annotations

import ctypes
import functools
import logging
import os
import platform
import struct
import sys

_MACHINES = {"x86_64": (0xC000003E, 54, 317), "aarch64": (0xC00000B7, 208, 277)}  # audit arch, setsockopt, seccomp
_LOAD, _EQUAL, _RETURN = 0x20, 0x15, 0x06  # BPF
_SOL_SOCKET, _SO_LINGER = 1, 13
_SUCCEED, _ALLOW = 0x00050000, 0x7FFF0000  # return 0 without the call; make the call
_NO_NEW_PRIVILEGES = 38  # prctl: without it only root may filter
_SET_FILTER, _ALL_THREADS, _NO_SLOWER_SPECULATION = 1, 1, 4


@functools.cache
def ignore_linger() -> None:
    """Make setsockopt(SO_LINGER) of this process and its children succeed without effect; a failure is logged."""
    if sys.platform != "linux":
        return
    try:
        _install(*_MACHINES[platform.machine()])
    except (KeyError, OSError) as error:
        logging.getLogger(__name__).warning("a silent peer may freeze this process for 10 s: no filter (%s)", error)


def _install(machine: int, setsockopt: int, seccomp: int) -> None:
    program = (
        (_LOAD, 0, 0, 4), (_EQUAL, 0, 7, machine), (_LOAD, 0, 0, 0), (_EQUAL, 0, 5, setsockopt),
        (_LOAD, 0, 0, 24), (_EQUAL, 0, 3, _SOL_SOCKET), (_LOAD, 0, 0, 32), (_EQUAL, 0, 1, _SO_LINGER),
        (_RETURN, 0, 0, _SUCCEED), (_RETURN, 0, 0, _ALLOW),
    )  # fmt: skip
    code = ctypes.create_string_buffer(b"".join(struct.pack("@HBBI", *step) for step in program))
    libc = ctypes.CDLL(None, use_errno=True)
    libc.prctl(_NO_NEW_PRIVILEGES, 1, 0, 0, 0)
    filtered = struct.pack("@HP", len(program), ctypes.addressof(code))
    if libc.syscall(seccomp, _SET_FILTER, _ALL_THREADS | _NO_SLOWER_SPECULATION, filtered) != 0:
        code_of_error = ctypes.get_errno()
        raise OSError(code_of_error, os.strerror(code_of_error))
