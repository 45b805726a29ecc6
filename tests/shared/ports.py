"""Free ports: of one test alone, whatever else runs on this machine."""

from __future__ import annotations

import contextlib
import os
import socket

from flockwire_core.wire.processes import DRONE_PORTS, SINGLE_PORTS

PORTS_NEEDED = SINGLE_PORTS + 5 * DRONE_PORTS  # of a swarm of up to five drones, ids 0 to 4; as many below them
FIRST_PORT, PLACES = 20000, 170  # so many swarms fit in below the ports that the system gives to whoever dials

_bases = iter(FIRST_PORT + (1 + (os.getpid() * 47 + k) % PLACES * 2) * PORTS_NEEDED for k in range(PLACES))
_claims: list[socket.socket] = []  # one for each range that this run has, held until it ends


def free_ports() -> int:
    """Return a base port with free ports round it, another one at each call and for each run on this machine."""
    for base in _bases:
        with contextlib.ExitStack() as stack, contextlib.suppress(OSError):
            claim = socket.socket()
            claim.bind(("127.0.0.3", base))  # where no swarm listens
            for port in range(base - PORTS_NEEDED, base + PORTS_NEEDED):
                stack.enter_context(socket.socket()).bind(("127.0.0.1", port))
            _claims.append(claim)
            return base
    raise RuntimeError("no free ports")


def free_port(kind: int = socket.SOCK_STREAM) -> int:
    """Return a free port of TCP, or of another `kind`."""
    with socket.socket(socket.AF_INET, kind) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])
