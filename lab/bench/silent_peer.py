"""How late the others are when one process falls silent: every packet to and from it is dropped for 14 s, or it stops.

    sudo lab/bench/silent_peer.py [--how drop|stop] [--repeats 5] [--only IDENTITY] [--swarm FILE] [--out FOLDER]

Each process of the paper's flight runs in a network namespace of its own, all on one bridge; needs root, `ip`, `nft`.
An observer with the recorder's certificate, in no namespace, receives what each of them publishes at a rate of its own.
Judged is the longest gap between two messages of one key, beyond its usual period, by the publisher's clock (its steps
were late) and by arrival (its network thread hung): in 14 s of silence and 3 s after it, and before it for comparison.
Takes some 35 s a flight; a machine that is busy with anything else is itself late.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import json
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path

import zenoh
from flockwire_core import clock
from flockwire_core.ground.order import Order
from flockwire_core.loading import load_swarm
from flockwire_core.security.files import files_of
from flockwire_core.security.pki import make_keys
from flockwire_core.wire.inbox import read_attachment
from flockwire_core.wire.keys import Key
from flockwire_core.wire.plan import Plan
from flockwire_lab.probe.attackers import Attacker, attacker_configuration
from flockwire_operator.station.giving import give
from flockwire_operator.station.host import Host

SWARM = Path(__file__).parents[2] / "examples/paper_flight.toml"
SWITCH, NETWORK = "flock-switch", "10.77.0"
SILENCE, BEFORE, AFTER = 14.0, 5.0, 3.0  # s
STARTS = 4  # how often `start` is given: processes in new namespaces take their time
PERIODS = {"command": 0.01, "truth": 0.01, "pose": 0.01, "status": 0.1}  # s, of the kinds of key that are judged
BAR = 0.05  # s by which anybody else may be late
SILENT = """
table inet silent {
    chain received { type filter hook input priority 0; policy drop; iif lo accept; }
    chain sent { type filter hook output priority 0; policy drop; oif lo accept; }
}
"""


def run(*line: object) -> None:
    """Run a command of the system; raises CalledProcessError."""
    subprocess.run([str(word) for word in line], check=True, capture_output=True)


@contextlib.contextmanager
def namespaces(plan: Plan) -> Iterator[dict[str, str]]:
    """Make a network namespace with its host's address for each process; yields their names, by identity.

    The bridge has one too, where no firewall of this machine stands between its ports.
    """
    names = {identity: f"flock-{identity}" for identity in plan.started}
    try:
        run("ip", "netns", "add", SWITCH)
        run("ip", "-n", SWITCH, "link", "add", "bridge", "type", "bridge")
        run("ip", "-n", SWITCH, "link", "set", "bridge", "up")
        run("ip", "link", "add", SWITCH, "type", "veth", "peer", "name", "outside", "netns", SWITCH)
        run("ip", "addr", "add", f"{NETWORK}.254/24", "dev", SWITCH)
        run("ip", "link", "set", SWITCH, "up")
        run("ip", "-n", SWITCH, "link", "set", "outside", "master", "bridge", "up")
        for identity, name in names.items():
            run("ip", "netns", "add", name)
            run("ip", "-n", SWITCH, "link", "add", identity, "type", "veth", "peer", "name", "eth0", "netns", name)
            run("ip", "-n", SWITCH, "link", "set", identity, "master", "bridge", "up")
            run("ip", "-n", name, "addr", "add", f"{plan.swarm.hosts[plan.hosts[identity]].address}/24", "dev", "eth0")
            for device in ("eth0", "lo"):
                run("ip", "-n", name, "link", "set", device, "up")
        yield names
    finally:
        for name in (*names.values(), SWITCH):
            subprocess.run(["ip", "netns", "del", name], check=False, capture_output=True)
        subprocess.run(["ip", "link", "del", SWITCH], check=False, capture_output=True)


def spread(source: Path, folder: Path) -> Path:
    """Write the swarm with a host, and so an address, for each of its processes; returns the file.

    Its airframes are all simulated: the drivers of Tellos would need Tellos in their namespaces.
    """
    path, hosts = folder / "swarm.toml", []
    text = re.sub(r'^airframe = "tello"$', "", source.read_text(), flags=re.MULTILINE)
    path.write_text(text)
    plan = Plan(load_swarm(path))
    for number, identity in enumerate(plan.started):
        drone = plan.members[identity].drone
        listed = "" if drone is not None else f'\nprocesses = ["{identity}"]'
        hosts.append(f'[hosts.h{number}]\naddress = "{NETWORK}.{number + 1}"{listed}\n')
        if drone is not None:
            text = re.sub(rf"^id = {drone}$", f'id = {drone}\nhost = "h{number}"', text, flags=re.MULTILINE)
    path.write_text("\n".join((text, *hosts)))
    return path


class Observer:
    """Receives what is judged of every process: when each message of a key was sent and when it arrived, s."""

    def __init__(self, plan: Plan, keys: Path) -> None:
        self.times: dict[tuple[str, Key], list[tuple[float, float]]] = {}
        self._plan = plan
        recorder = plan.recorders[0]
        self._attacker = Attacker(recorder, files_of(keys, recorder), "peer")
        self._authority = str(keys / "ca.crt")

    @contextlib.contextmanager
    def watching(self) -> Iterator[None]:
        """Receive for as long as the context lasts."""
        plan = self._plan
        targets = [plan.locator(endpoint) for endpoint in plan.endpoints.values()]
        with zenoh.open(attacker_configuration(self._attacker, targets, self._authority)) as session:
            for key, publishers, _ in plan.flows:
                if key.kind in PERIODS and publishers[0] not in plan.recorders:  # nobody serves it its own status
                    self._subscribe(session, publishers[0], key)
            yield

    def _subscribe(self, session: zenoh.Session, publisher: str, key: Key) -> None:
        times = self.times[publisher, key] = []

        def arrived(sample: zenoh.Sample) -> None:
            if sample.attachment is not None:
                times.append((read_attachment(sample.attachment.to_bytes()).sent / 1e9, clock.now() / 1e9))

        session.declare_subscriber(self._plan.text(key), zenoh.handlers.Callback(arrived, indirect=False))

    def late(self, victim: str, begin: float, end: float) -> dict[str, tuple[float, float]]:
        """Return by how much, s, each other process was late between two times: its steps, what it sent to arrive.

        What it publishes for each message of the victim, and so not now, is left out.
        """
        found: dict[str, tuple[float, float]] = {}
        for (publisher, key), times in self.times.items():
            follows = key.kind == "pose" and self._plan.publishes_to(victim, publisher)
            if publisher == victim or follows:
                continue
            worst = found.get(publisher, (0.0, 0.0))
            gaps = [[max(later - PERIODS[key.kind], 0.0) for later in _gaps(column, begin, end)]
                    for column in zip(*times, strict=True)]  # fmt: skip
            steps, arrivals = (max(column, default=0.0) for column in gaps) if gaps else (end - begin, end - begin)
            found[publisher] = (max(worst[0], steps), max(worst[1], arrivals))
        return found


def _gaps(times: tuple[float, ...], begin: float, end: float) -> list[float]:
    """Return the gaps between the times from `begin` to `end`, the one up to the end included."""
    inside = [begin, *sorted(at for at in times if begin <= at <= end), end]
    return [later - earlier for earlier, later in pairwise(inside)]


@contextlib.contextmanager
def silent(victim: str, name: str, process: subprocess.Popen[bytes], how: str) -> Iterator[None]:
    """Silence the victim, whose namespace is `name`, for as long as the context lasts."""
    if how == "stop":
        process.send_signal(signal.SIGSTOP)
    else:
        subprocess.run(["ip", "netns", "exec", name, "nft", "-f", "-"], input=SILENT.encode(), check=True)
    try:
        yield
    finally:
        if how == "stop":
            process.send_signal(signal.SIGCONT)
        else:
            run("ip", "netns", "exec", name, "nft", "delete", "table", "inet", "silent")


def trial(plan: Plan, swarm: Path, folder: Path, victim: str, how: str) -> dict[str, dict[str, tuple[float, float]]]:
    """Fly once, with `victim` silent in formation; returns how late the others were before it and from then on."""
    keys, observer = folder / "keys", None
    make_keys(plan, keys, clock.utc())
    with namespaces(plan) as names, contextlib.ExitStack() as stack:
        processes = {}
        for identity, name in names.items():
            line = Host(plan, swarm, plan.hosts[identity], folder / "out", keys).command_line(identity)
            with (folder / f"{identity}.log").open("wb") as log:
                process = subprocess.Popen(["ip", "netns", "exec", name, *line], stdout=log, stderr=log)
            stack.callback(_killed, process)
            processes[identity] = process
        observer = Observer(plan, keys)
        stack.enter_context(observer.watching())
        answer, tries = asyncio.run(give(plan, keys, Order("start"))), 1
        while (answer.refusal or answer.missing) and tries < STARTS:
            answer, tries = asyncio.run(give(plan, keys, Order("start"))), tries + 1
        if answer.refusal or answer.missing:
            raise SystemExit(f"the flight did not start: {answer.refusal or answer.missing}")
        time.sleep(BEFORE)
        at = clock.now() / 1e9
        with silent(victim, names[victim], processes[victim], how):
            time.sleep(SILENCE)
        time.sleep(AFTER)
        return {
            "before": observer.late(victim, at - BEFORE, at),
            "after": observer.late(victim, at, at + SILENCE + AFTER),
        }


def _killed(process: subprocess.Popen[bytes]) -> None:
    process.kill()
    process.wait()


def main() -> None:
    """Silence each process in turn; print a row for each flight."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--how", choices=("drop", "stop"), default="drop")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--only", default="")
    parser.add_argument("--swarm", type=Path, default=SWARM)
    parser.add_argument("--out", type=Path, default=Path("runs/silent_peer"))
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    results = []
    for repeat in range(options.repeats):
        with tempfile.TemporaryDirectory() as scratch:
            swarm = spread(options.swarm, Path(scratch))
            plan = Plan(load_swarm(swarm))
            for victim in [name for name in plan.started if options.only in ("", name)]:
                folder = Path(scratch) / victim
                late = trial(plan, swarm, folder, victim, options.how)
                results.append({"victim": victim, "how": options.how, "repeat": repeat, **late})
                _row(victim, late)
                (options.out / "silent_peer.json").write_text(json.dumps(results, indent=1) + "\n")
    bad = sum(max(map(max, result["after"].values())) > BAR for result in results)
    print(f"{len(results)} flights, {bad} with somebody else late by more than {1000 * BAR:.0f} ms")
    sys.exit(bool(bad))


def _row(victim: str, late: dict[str, dict[str, tuple[float, float]]]) -> None:
    def worst(when: str, which: Callable[[tuple[float, float]], float]) -> str:
        name, figures = max(late[when].items(), key=lambda item: which(item[1]))
        return f"{1000 * which(figures):6.0f} ms ({name})"

    print(
        f"{victim:11} before: steps {worst('before', _steps):22} arrival {worst('before', _arrivals):22} "
        f"after: steps {worst('after', _steps):22} arrival {worst('after', _arrivals)}", flush=True,
    )  # fmt: skip


def _steps(figures: tuple[float, float]) -> float:
    return figures[0]


def _arrivals(figures: tuple[float, float]) -> float:
    return figures[1]


if __name__ == "__main__":
    main()
