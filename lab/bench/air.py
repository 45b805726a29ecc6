"""A radio network in user space: an Ethernet switch that loses and delays frames, with a TAP device for each host.

Kernels without `sch_netem` cannot delay packets. A frame from one host to another is lost with a probability, or
arrives after delay ± jitter (uniform), never before an earlier one of the same two hosts. Needs root and /dev/net/tun.
"""

from __future__ import annotations

import contextlib
import fcntl
import heapq
import multiprocessing
import os
import select
import signal
import struct
import subprocess
import time
from collections.abc import Iterator, Mapping
from multiprocessing.connection import Connection
from random import Random
from typing import NamedTuple

TUNSETIFF = 0x400454CA
IFF_TAP, IFF_NO_PI = 0x0002, 0x1000
FRAME = 65536
OUTSIDE = "outside"  # the port of the host that the namespaces are on
TAP = "air-"


class Conditions(NamedTuple):
    """What every link is like: share of frames lost, s."""

    loss: float = 0.0
    delay: float = 0.0
    jitter: float = 0.0


class Air:
    """The network while it is there."""

    def __init__(self, orders: Connection) -> None:
        self._orders = orders

    def become(self, conditions: Conditions, silent: tuple[str, ...] = ()) -> None:
        """Have the links be like this from now on; nothing goes to or from the hosts `silent`."""
        self._orders.send((conditions, silent))


@contextlib.contextmanager
def air(addresses: Mapping[str, str], outside: str) -> Iterator[tuple[Air, dict[str, str]]]:
    """Make a namespace with its address for each host, on one network; yields the network and their names, by host.

    `outside` is the address there of who calls this.
    """
    names = {host: f"{TAP}{host}" for host in addresses}
    ports = {host: _tap(f"{TAP}{host}") for host in (*addresses, OUTSIDE)}
    here, there = multiprocessing.Pipe()
    switch = multiprocessing.get_context("fork").Process(target=_switch, args=(ports, there), daemon=True)
    switch.start()
    try:
        _ip("addr", "add", f"{outside}/24", "dev", f"{TAP}{OUTSIDE}")
        _ip("link", "set", f"{TAP}{OUTSIDE}", "up")
        for host, name in names.items():
            _ip("netns", "add", name)
            _ip("link", "set", name, "netns", name)
            _ip("-n", name, "addr", "add", f"{addresses[host]}/24", "dev", name)
            for device in (name, "lo"):
                _ip("-n", name, "link", "set", device, "up")
        yield Air(here), names
    finally:
        switch.kill()
        switch.join()
        for port in ports.values():
            os.close(port)  # and with it the device
        for name in names.values():
            subprocess.run(["ip", "netns", "del", name], check=False, capture_output=True)


def _tap(name: str) -> int:
    port = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
    fcntl.ioctl(port, TUNSETIFF, struct.pack("16sH22x", name.encode(), IFF_TAP | IFF_NO_PI))
    return port


def _ip(*words: str) -> None:
    subprocess.run(["ip", *words], check=True, capture_output=True)


def _switch(ports: dict[str, int], orders: Connection) -> None:
    """Carry frames until killed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    chance, conditions, silent = Random(1), Conditions(), frozenset[int]()
    homes: dict[bytes, int] = {}  # which port an address is at
    waiting: list[tuple[float, int, int, bytes]] = []  # due, number, port, frame
    last: dict[tuple[int, int], float] = {}  # when the latest frame between two ports is due
    number = 0
    poll = select.epoll()
    for descriptor in (*ports.values(), orders.fileno()):
        poll.register(descriptor, select.EPOLLIN)
    while True:
        now = time.monotonic()
        while waiting and waiting[0][0] <= now:
            _, _, port, frame = heapq.heappop(waiting)
            with contextlib.suppress(OSError):  # the device is down
                os.write(port, frame)
        for source, _ in poll.poll(max(waiting[0][0] - now, 0.0) if waiting else None):
            if source == orders.fileno():
                conditions, hosts = orders.recv()
                silent = frozenset(ports[host] for host in hosts)
                continue
            try:
                frame = os.read(source, FRAME)
            except OSError:
                continue
            homes[frame[6:12]] = source
            home, now = homes.get(frame[:6]), time.monotonic()
            for target in (home,) if home is not None else ports.values():
                lost = chance.random() < conditions.loss or source in silent or target in silent
                if target == source or lost:
                    continue
                due = now + conditions.delay + conditions.jitter * chance.uniform(-1.0, 1.0)
                due = last[source, target] = max(due, last.get((source, target), 0.0))
                number += 1
                heapq.heappush(waiting, (due, number, target, frame))
