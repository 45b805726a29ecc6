"""The UDP sockets of a NatNet client, read until they are empty: the last datagram is the newest."""

from __future__ import annotations

import socket
import sys
from collections.abc import Iterator

BUFFER = 1 << 20  # bytes of the socket's queue: a second of frames and more
LONGEST = 65535  # bytes of a datagram
MOST = 512  # datagrams that are read in a row before other tasks run


def command_socket(local: str) -> socket.socket:
    """Return a socket that sends from the address `local`, from any port; raises OSError if it is not of this host."""
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFER)
    sock.setblocking(False)
    sock.bind((local, 0))
    return sock


def multicast_socket(group: tuple[str, int], local: str) -> socket.socket:
    """Return a socket that receives what is sent to the group (address, port) on the interface `local`."""
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # others on this host may listen too
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFER)
    sock.setblocking(False)
    address, port = group
    sock.bind(("" if sys.platform == "win32" else address, port))  # by its address: nothing else sent to the port
    membership = socket.inet_aton(address) + socket.inet_aton(local)
    sock.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, membership)
    return sock


def waiting(sock: socket.socket) -> Iterator[tuple[bytes, str]]:
    """Yield the datagrams that have arrived, each with the address that it came from."""
    for _ in range(MOST):
        try:
            data, sender = sock.recvfrom(LONGEST)
        except BlockingIOError:
            return
        except OSError:  # the server's host has refused a datagram (ICMP): it is not there yet
            continue
        yield data, sender[0]
