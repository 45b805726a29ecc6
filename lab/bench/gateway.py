"""What the gateway costs with N bodies at 100 Hz: share of one core, and time per body, over N.

    python lab/bench/gateway.py [--seconds 5] [--drones 10] [--bodies 25,50,100,200] [--all-drones]

NatNet datagrams go through the parser, the source and the core, and what is published is encoded, as in flight; only
the network itself is left out. Bodies are 1 m apart; `--drones` of them are a swarm's, the others persons, or with
`--all-drones` all are drones. Ends with status 1 if 200 bodies take more than 60 % of a core.
"""

from __future__ import annotations

import argparse
import sys
from math import ceil, sqrt
from random import Random

from flockwire_core import clock
from flockwire_core.domain.time import SECOND
from flockwire_core.loading import parse_swarm
from flockwire_core.process.cores import Start
from flockwire_core.wire import codec
from flockwire_core.wire.plan import Plan
from flockwire_mocap.core import GatewayCore, make_core
from flockwire_mocap.natnet.encoding import encode
from flockwire_mocap.natnet.packets import Kind
from flockwire_mocap.natnet.source import NatNetSource
from flockwire_mocap.tracking import ReportedBody, TrackerFrame
from flockwire_twins.trackers.natnet import NatNetTwin, TwinOptions

RATE = 100  # Hz
BAR, BODIES = 0.6, 200  # share of a core, with so many bodies
HOME, CLIENT = "127.0.0.1", ("127.0.0.1", 5000)


def gateway(drones: int, bodies: int) -> tuple[GatewayCore, NatNetTwin]:
    """Return a gateway that has greeted a server of `bodies` bodies, `drones` of which are its swarm's."""
    side = ceil(sqrt(bodies))
    table: dict[str, object] = {
        "name": "crowd",
        "formation": {"kind": "circle", "radius": max(2.0, drones / 4.0), "rate": 0.01},
        "graph": {"edges": [[0, i] for i in range(1, drones)]},
        "limits": {"fence": {"min": [-200.0, -200.0, -1.0], "max": [200.0, 200.0, 5.0]}},
        "drones": [{"id": i, "start": [float(i % side), float(i // side), 0.0]} for i in range(drones)],
        "gateway": {"source": "natnet"},
    }
    core = make_core(Start(Plan(parse_swarm(table, "bench")), "gateway", clock.now(), Random(0)))
    names = {i: f"uav{i}" if i < drones else f"person {i}" for i in range(bodies)}
    twin = NatNetTwin(TwinOptions((4, 1)), names)
    assert isinstance(core.source, NatNetSource)
    for _ in range(2):
        for request in core.source.session.requests(clock.now()):
            answer = twin.receive(request, CLIENT, clock.now())
            if answer is not None:
                core.source.session.receive(answer, HOME, clock.now())
    assert len(core.source.session.names) == bodies
    return core, twin


def frame(number: int, bodies: int) -> TrackerFrame:
    """Return a frame of bodies that walk at 1 m/s, side by side."""
    side, now = ceil(sqrt(bodies)), number * SECOND // RATE
    row = (
        ReportedBody(i, None, (number / RATE + i % side, 1.0, -float(i // side)), (0.0, 0.0, 0.0, 1.0), tracked=True)
        for i in range(bodies)
    )
    return TrackerFrame(number, now, now, tuple(row))


def measure(drones: int, bodies: int, seconds: float) -> tuple[float, float, int]:
    """Return the share of a core, us for each body and frame, and messages published in a frame."""
    core, twin = gateway(drones, bodies)
    source = core.source
    assert isinstance(source, NatNetSource)
    begin, used, published = clock.now(), 0, 0
    frames = round(seconds * RATE)
    for number in range(frames):
        twin.receive(encode(Kind.KEEP_ALIVE), CLIENT, begin + number * SECOND // RATE)
        ((datagram, _),) = twin.datagrams(frame(number, bodies), begin + number * SECOND // RATE)
        now, before = begin + number * SECOND // RATE, clock.cpu_time()
        arrived = source.session.receive(datagram, HOME, now)
        if arrived is not None:
            source.arrived(arrived, now)
        messages = [codec.encode(message) for _, message in core.step(now)]
        used += clock.cpu_time() - before
        published = len(messages)
    return used / seconds, 1e6 * used / frames / bodies, published


def main() -> None:
    """Measure all."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=5.0)
    parser.add_argument("--drones", type=int, default=10)
    parser.add_argument("--bodies", type=lambda text: [int(n) for n in text.split(",")], default=[25, 50, 100, BODIES])
    parser.add_argument("--all-drones", action="store_true")
    options = parser.parse_args()
    print(f"{'bodies':>7}{'drones':>8}{'messages':>10}{'of a core':>11}{'us/body':>9}")
    well = True
    for bodies in options.bodies:
        drones = bodies if options.all_drones else min(options.drones, bodies)
        share, each, published = measure(drones, bodies, options.seconds)
        print(f"{bodies:7}{drones:8}{published:10}{share:11.1%}{each:9.1f}", flush=True)
        well = well and (bodies < BODIES or share <= BAR)
    sys.exit(not well)


if __name__ == "__main__":
    main()
