"""Shuts out addresses whose connections make others wait, before Zenoh sees them.

Zenoh pauses for 0.1 s after each TLS handshake that fails, and keeps silent connections. An address that has many in
two looks in a row gets no further one for a while, each time for twice as long: a filter at the listening socket
(SO_ATTACH_FILTER, Linux, IPv4) drops its first packets. What is linked stays linked.

The process also raises its limit of descriptors, so that connections without any key do not take the last one.
"""

from __future__ import annotations

import contextlib
import ctypes
import logging
import os
import resource
import socket
import struct
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Final

from flockwire_core.domain.time import SECOND

SHUT = 10 * SECOND  # ns for which an address stays shut out for the first time
LONGEST = 32 * SHUT  # ns, at most
LEFT = 5  # connections, as which one counts that its other end has left: whoever waits for an answer stays
_DESCRIPTORS = Path("/proc/self/fd")
_SOCK_DIAG, _BY_FAMILY, _DUMP = 4, 20, 0x301  # of netlink
_CLOSE_WAIT = 8
_STATES = 1 << 1 | 1 << _CLOSE_WAIT  # established, or left by the other end
_REQUEST = struct.Struct("=IHHIIBBxxIH46x")  # struct nlmsghdr, struct inet_diag_req_v2
_HEADER = struct.Struct("=IH")  # of struct nlmsghdr
_STATE, _REMOTE = 17, 40  # offsets of state and the other end's address, after struct nlmsghdr in struct inet_diag_msg
_SO_ACCEPTCONN, _SO_ATTACH_FILTER, _SO_DETACH_FILTER = 30, 26, 27
_BYTE, _WORD, _AND, _EQUAL, _RETURN = 0x30, 0x20, 0x54, 0x15, 0x06  # BPF
_FLAGS, _SYN, _SYN_ACK = 13, 0x02, 0x12  # offset in the TCP header
_SOURCE = -0x100000 + 12  # in the IP header, SKF_NET_OFF
_PASS, _DROP = 0x7FFFFFFF, 0
MOST = 65536  # descriptors of one process; 6 KB of memory for each connection


class Gate:
    """The gate in front of one port of this process; `shut` has the addresses that are shut out.

    An address may have `most` connections more than there are authenticated ones, which `linked` returns.
    """

    def __init__(self, port: int, most: int, linked: Callable[[], int]) -> None:
        self.shut: dict[str, int] = {}  # until when, ns
        self._port, self._most, self._linked = port, most, linked
        self._listener = _listener(port) if sys.platform == "linux" else None
        self._suspects: set[str] = set()
        self._terms: dict[str, int] = {}  # ns, the last one of each that was shut out
        self._calm = _lowest_free(self._listener) if self._listener is not None else 0  # at the last look without any

    def close(self) -> None:
        """Release the listening socket."""
        if self._listener is not None:
            self._listener.close()
            self._listener = None

    def look(self, now: int) -> None:
        """Count the connections at `now` (ns), about once a second."""
        if self._listener is None:
            return
        try:
            self._look(self._listener, now)
        except OSError as error:  # a sandbox may forbid it
            logging.getLogger(__name__).warning("shuts out no address with bad connections (%s)", error)
            self.close()

    def _look(self, listener: socket.socket, now: int) -> None:
        free = _lowest_free(listener)
        if LEFT * (free - self._calm) <= self._most and not self.shut:  # spares the kernel's list, 2 ms
            self._suspects, self._calm = set(), min(free, self._calm)
            return
        most = self._most + self._linked()
        suspects = {one for one, count in Counter(_connections(self._port)).items() if count > most}
        shut = {one: end for one, end in self.shut.items() if end > now}
        for one in suspects & (self._suspects | self._terms.keys()):
            if one not in shut:
                self._terms[one] = min(2 * self._terms.get(one, SHUT // 2), LONGEST)
            shut[one] = now + self._terms[one]
        self._suspects, self._calm = suspects, self._calm if suspects else free
        if shut.keys() != self.shut.keys():
            _filter(listener, list(shut)[-200:])  # addresses; the jumps of a filter reach 255 steps
        self.shut = shut


def _lowest_free(listener: socket.socket) -> int:
    """Return the lowest descriptor that is free: the more are open, the higher."""
    found = os.dup(listener.fileno())
    os.close(found)
    return found


def _connections(port: int) -> Iterator[str]:
    """Yield the other end's address of each connection to `port` (sock_diag(7)), LEFT times of one that is left."""
    wanted = socket.AF_INET, socket.IPPROTO_TCP, _STATES, socket.htons(port)
    request = _REQUEST.pack(_REQUEST.size, _BY_FAMILY, _DUMP, 0, 0, *wanted)
    with socket.socket(socket.AF_NETLINK, socket.SOCK_RAW, _SOCK_DIAG) as kernel:
        kernel.send(request)
        while True:
            data, at = kernel.recv(1 << 17), 0
            while at < len(data):
                size, kind = _HEADER.unpack_from(data, at)
                if kind != _BY_FAMILY:  # the end of all, or an error
                    return
                address = socket.inet_ntoa(data[at + _REMOTE : at + _REMOTE + 4])
                yield from [address] * (LEFT if data[at + _STATE] == _CLOSE_WAIT else 1)
                at += (size + 3) & ~3


def _listener(port: int) -> socket.socket | None:
    """Return another descriptor of this process's socket that listens at `port`."""
    sockets = [path for path in _DESCRIPTORS.iterdir() if path.is_socket()]
    for path in sockets:  # of another kind, the copy would stay open
        with contextlib.suppress(OSError), contextlib.ExitStack() as stack:
            copied = os.dup(int(path.name))  # socket.dup() makes accept() block
            found = stack.enter_context(socket.socket(fileno=copied))
            listens = found.family == socket.AF_INET and found.getsockopt(socket.SOL_SOCKET, _SO_ACCEPTCONN)
            if listens and found.getsockname()[1] == port:
                stack.pop_all()
                return found
    return None


def _filter(listener: socket.socket, addresses: list[str]) -> None:
    if not addresses:
        listener.setsockopt(socket.SOL_SOCKET, _SO_DETACH_FILTER, 0)
        return
    count: Final = len(addresses)
    program = [(_BYTE, 0, 0, _FLAGS), (_AND, 0, 0, _SYN_ACK), (_EQUAL, 0, count + 1, _SYN), (_WORD, 0, 0, _SOURCE)]
    for i, address in enumerate(addresses):
        program.append((_EQUAL, count - i, 0, int.from_bytes(socket.inet_aton(address), "big")))
    program += [(_RETURN, 0, 0, _PASS), (_RETURN, 0, 0, _DROP)]
    code = ctypes.create_string_buffer(
        b"".join(struct.pack("@HBBI", *step[:3], step[3] & 0xFFFFFFFF) for step in program)
    )
    listener.setsockopt(socket.SOL_SOCKET, _SO_ATTACH_FILTER, struct.pack("@HP", len(program), ctypes.addressof(code)))


def raise_limit() -> None:
    """Raise the soft limit of this process, and of its children, to the hard one, but to MOST at most."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = MOST if hard == resource.RLIM_INFINITY else min(hard, MOST)
    if soft == resource.RLIM_INFINITY or soft >= wanted:
        return
    with contextlib.suppress(OSError, ValueError):  # macOS has a lower limit of its own
        resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))
