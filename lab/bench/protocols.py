"""The paper's flight through every tracker protocol, against the same flight with simulated cameras.

    python lab/bench/protocols.py [SWARM] [--seconds 30] [--seed 0] [--real]

Cameras with noise 1 mm and latency 8 ms; 1 % of frames are lost (of samples, with simulated cameras). In virtual time
every frame goes through the protocol's own bytes, from the twin's encoder to the gateway's parser; only the sockets are
left out. With `--real` each is a flight by `flockwire up`, `tracker-sim` and sockets included. Ends with status 1 if a
formation error (largest in the tail, obstacles apart) is 10 mm above that of simulated cameras.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Callable
from pathlib import Path

import tomli_w
from flockwire_analysis.summary import summarise
from flockwire_core.loading import load_swarm
from flockwire_core.process.cores import Start
from flockwire_core.swarm.gateway import Gateway, Qualisys, Twin, Vrpn
from flockwire_core.swarm.model import Swarm
from flockwire_core.wire.codec import Message
from flockwire_core.wire.keys import Key
from flockwire_core.wire.plan import Plan
from flockwire_lab.flight import TraceInMemory
from flockwire_lab.world import World
from flockwire_mocap import core
from flockwire_mocap.natnet.source import NatNetSource
from flockwire_mocap.qualisys.source import QualisysSource
from flockwire_mocap.streamed import StreamedSource
from flockwire_mocap.tracking import SourceState, TrackerFrame
from flockwire_mocap.vrpn.connection import VrpnConnection
from flockwire_mocap.vrpn.source import VrpnSource
from flockwire_mocap.vrpn.wire import PoseBody
from flockwire_twins.trackers.core import TwinCore
from flockwire_twins.trackers.natnet import NatNetTwin, TwinOptions
from flockwire_twins.trackers.qualisys_wire import HEADER, encode_frame
from qtm_rt.packet import QRTPacket

NOISE, LATENCY, LOSS = 0.001, 0.008, 0.01  # m, s, share of frames
BAR = 0.01  # m above the error with simulated cameras
HOME, CLIENT = "127.0.0.1", ("127.0.0.1", 5000)

Carry = Callable[[TrackerFrame, int], None]


def natnet(source: NatNetSource, twin: TwinCore) -> Carry:
    """Return what carries a frame through NatNet."""
    server = NatNetTwin(TwinOptions((4, 1)), twin.names)

    def carry(frame: TrackerFrame, now: int) -> None:
        for request in source.session.requests(now):
            answer = server.receive(request, CLIENT, now)
            if answer is not None:
                source.session.receive(answer, HOME, now)
        for datagram, _ in server.datagrams(frame, now):
            arrived = source.session.receive(datagram, HOME, now)
            if arrived is not None:
                source.arrived(arrived, now)

    return carry


def vrpn(source: VrpnSource, twin: TwinCore) -> Carry:
    """Return what carries a frame through VRPN."""
    server = VrpnConnection()

    def carry(frame: TrackerFrame, now: int) -> None:
        for body in frame.bodies:
            if body.tracked:
                server.send_pose(body.name or "", frame.captured, PoseBody(0, body.position, body.orientation))
        source.read(server.outgoing(), now)

    return carry


def qualisys(source: QualisysSource, twin: TwinCore) -> Carry:
    """Return what carries a frame through QTM's protocol."""
    source.names = tuple(twin.names.values())

    def carry(frame: TrackerFrame, now: int) -> None:
        packet = QRTPacket(encode_frame(frame)[HEADER.size :])
        bodies = [((place.x, place.y, place.z), turn.matrix) for place, turn in packet.get_6d()[1]]
        source.measured(packet.framenumber, packet.timestamp, bodies, now)

    return carry


PROTOCOLS: dict[str, Callable[..., Carry]] = {"natnet": natnet, "vrpn": vrpn, "qualisys": qualisys}


class Carried:
    """A source of virtual time whose frames have gone through a protocol."""

    def __init__(self, start: Start, protocol: str) -> None:
        gateway = _gateway(source=protocol, twin=Twin(loss=LOSS))
        begun = start._replace(plan=Plan(start.plan.swarm.tracked_by(gateway)))
        self._twin = TwinCore(begun)
        source = core.SOURCES[protocol](begun)
        assert isinstance(source, StreamedSource)
        self._source, self._sent = source, list[TrackerFrame]()
        self._carry = PROTOCOLS[protocol](source, self._twin)
        self._twin.deliver = self._sent.append
        self.triggers = self._twin.triggers

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Receive where an airframe is."""
        self._twin.receive(key, message, now)

    def complete(self) -> bool:
        """Return whether all airframes have reported."""
        return self._twin.due(next(iter(self.triggers)))

    def take(self, now: int) -> list[TrackerFrame]:
        """Return what has come through."""
        self._twin.step(now)
        for frame in self._sent:
            self._carry(frame, now)
        self._sent.clear()
        return self._source.take(now)

    def state(self, now: int) -> SourceState:
        """Return how the connection is."""
        return self._source.state(now)


def _gateway(**more: object) -> Gateway:
    table = Gateway(noise=NOISE, latency=LATENCY, vrpn=Vrpn(latency=LATENCY), qualisys=Qualisys(latency=LATENCY))
    return table.model_copy(update=more)


def error(swarm: Swarm, source: str, seconds: float, seed: int) -> float:
    """Fly once; returns the largest formation error in the tail, m."""
    usual = core.SOURCES
    if source in PROTOCOLS:
        core.SOURCES = {**usual, "simulated": lambda start: Carried(start, source)}
    flown = swarm.tracked_by(_gateway(dropout=LOSS))
    trace = TraceInMemory(flown, seed)
    try:
        World(flown, seed, seconds, (), trace.take).run()
    finally:
        core.SOURCES = usual
    summary = summarise(trace.trace())
    tails = [phase.judged_tail_m for phase in summary.phases if phase.judged_tail_m is not None]
    return _told(source, max(tails), summary.tracker)


def real_error(file: Path, source: str, seconds: float) -> float:
    """Fly once for real; returns the largest formation error in the tail, m."""
    table = tomllib.loads(file.read_text())
    table["gateway"] = {"source": source, "noise": NOISE, "latency": LATENCY}
    if source in PROTOCOLS:
        table["gateway"] |= {"twin": {"loss": LOSS}, **({source: {"latency": LATENCY}} if source != "natnet" else {})}
    else:
        table["gateway"]["dropout"] = LOSS
    with tempfile.TemporaryDirectory() as folder:
        swarm, out = Path(folder) / "swarm.toml", Path(folder) / "out"
        swarm.write_text(tomli_w.dumps(table))
        line = ["up", str(swarm), "--headless", "--duration", str(seconds), "--out", str(out)]
        subprocess.run([sys.executable, "-m", "flockwire_operator", *line], check=False, capture_output=True)
        summary = json.loads((out / "summary.json").read_text())
    tails = [phase["judged_tail_m"] for phase in summary["phases"] if phase["judged_tail_m"] is not None]
    return _told(source, max(tails), summary["tracker"])


def _told(source: str, tail: float, tracker: object) -> float:
    print(f"{source:10} formation error {1000 * tail:6.1f} mm   {tracker}", flush=True)
    return tail


def main() -> None:
    """Fly all."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("swarm", nargs="?", type=Path, default=Path("examples/paper_simulation.toml"))
    parser.add_argument("--seconds", type=float, default=30.0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--real", action="store_true")
    options = parser.parse_args()
    swarm = load_swarm(options.swarm)
    errors = {
        source: real_error(options.swarm, source, options.seconds)
        if options.real
        else error(swarm, source, options.seconds, options.seed)
        for source in ("simulated", *PROTOCOLS)
    }
    sys.exit(max(errors.values()) > errors["simulated"] + BAR)


if __name__ == "__main__":
    main()
