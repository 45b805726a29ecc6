"""One flight, watched and attacked from outside: who is linked, and what nothing forged, repeated or refused changes.

All tests share the flight, so they count from what was counted before; none may end a process.
"""

from __future__ import annotations

import contextlib
import random
import socket
import ssl
import time
from collections import Counter
from collections.abc import Callable, Collection, Iterator
from pathlib import Path

import pytest
import zenoh
from fleet import Fleet, Tower, copy_swarm, processes_of
from flockwire_core import clock
from flockwire_core.security.pki import make_keys
from flockwire_core.wire.batch import Batch
from flockwire_core.wire.codec import decode
from flockwire_core.wire.inbox import attachment, read_attachment
from flockwire_core.wire.keys import BATCH, MISSION, ROWS, Key
from flockwire_core.wire.status import Status

FOLLOWERS = ("uav1", "uav2", "uav3", "uav4")
CIRCLE = 'kind = "circle"\nradius = 0.5\nrate = 0.2'  # a leader that stays clear of obstacle and fence
Flight = tuple[Fleet, Tower]


@pytest.fixture(scope="module")
def airborne(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Flight]:
    """Fly the paper's swarm round a leader that circles, for the whole module."""
    folder = tmp_path_factory.mktemp("flight")
    swarm = copy_swarm(folder)
    straight = 'kind = "constant"\nvelocity = [0.1, 0.1, 0.0]'
    text = swarm.read_text()
    assert straight in text
    swarm.write_text(text.replace(straight, CIRCLE))
    fleet = Fleet(swarm, folder / "fleet")
    try:
        fleet.start()
        tower = Tower(fleet.plan, fleet.keys)
        try:
            tower.fly()
            yield fleet, tower
        finally:
            tower.close()
    finally:
        fleet.end_all()
    assert not processes_of(swarm)


@pytest.fixture
def flight(airborne: Flight) -> Iterator[Flight]:
    """Return the flight, in formation; check that it still is so afterwards, and that every process made steps."""
    fleet, tower = airborne
    tower.all_in("formation")
    tower.settled(0.05)
    before = everybody(airborne)
    yield airborne
    assert all(process.poll() is None for process in fleet.running.values())
    tower.all_in("formation")
    tower.settled(0.05)
    after = everybody(airborne)
    assert all(after[name].steps > before[name].steps for name in before if name != "recorder")


def everybody(flight: Flight) -> dict[str, Status]:
    """Return the fresh statuses of all processes."""
    fleet, tower = flight
    return tower.wait(lambda seen: seen.keys() == fleet.running.keys())


def rejections(statuses: dict[str, Status]) -> Counter[tuple[str, str]]:
    """Return how many messages each process rejected, by process and key."""
    counts: Counter[tuple[str, str]] = Counter()
    for name, status in statuses.items():
        for reason, count in status.rejected:
            counts[name, reason.partition(" ")[0]] += count
    return counts


def overhear(fleet: Fleet, take: Callable[[str, bytes, bytes], object], seconds: float) -> None:
    """Subscribe as the recorder for a while; `take` gets key, payload and attachment of all, in batches or not."""

    def arrived(sample: zenoh.Sample) -> None:
        text, payload, attached = str(sample.key_expr), sample.payload.to_bytes(), sample.attachment.to_bytes()
        if not text.endswith(f"/{BATCH}"):
            take(text, payload, attached)
            return
        for entry in decode(Batch, payload).entries:
            owner, kind = entry.key.split("/")
            publisher = read_attachment(attached).publisher
            own = attachment(entry.sequence, entry.sent, publisher, Key(kind, owner))
            take(fleet.plan.text(Key(kind, owner)), entry.payload, own)

    with fleet.insider("recorder") as session:
        for key in fleet.plan.subscribes["recorder"]:
            session.declare_subscriber(fleet.plan.text(key), zenoh.handlers.Callback(arrived, indirect=False))
        time.sleep(seconds)


def readers(fleet: Fleet, keys: Collection[str]) -> list[tuple[str, str]]:
    """Return every process with each of these keys that it subscribes to and counts for itself.

    That is not the recorder, which takes everything; nor any with the mission, which the gateway repeats unchanged.
    """
    subscribed = [(name, key) for name in fleet.running if name != "recorder" for key in fleet.plan.subscribes[name]]
    return [(name, text) for name, key in subscribed if key != MISSION and (text := fleet.plan.text(key)) in keys]


def test_every_process_is_linked_to_its_publishers_only(flight: Flight) -> None:
    fleet, tower = flight
    there = {*fleet.running, "operator"}  # of the operators only one
    wanted = {name: sorted(there.intersection(fleet.plan.partners[name])) for name in fleet.running}
    tower.wait(lambda seen: {name: sorted(status.links) for name, status in seen.items()} == wanted)
    time.sleep(1.2)  # links are looked at once a second
    assert {name: sorted(status.links) for name, status in everybody(flight).items()} == wanted


def dial(endpoint: str, credentials: Path | None) -> None:
    """Connect to a process over TLS with a certificate and its key (without one: None), until it hangs up."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    if credentials is not None:
        context.load_cert_chain(credentials.with_suffix(".crt"), credentials.with_suffix(".key"))
    host, _, port = endpoint.rpartition(":")
    with contextlib.suppress(ssl.SSLError, OSError), socket.create_connection((host, int(port)), 5.0) as plain:
        assert context.wrap_socket(plain).recv(100) == b""


def test_a_connection_without_a_good_certificate_is_refused_and_counted(flight: Flight, tmp_path: Path) -> None:
    fleet, tower = flight
    make_keys(fleet.plan, tmp_path / "strangers", clock.utc())  # of another authority
    listening = fleet.plan.endpoints.items() & {(name, fleet.plan.endpoints.get(name, "")) for name in fleet.running}
    assert len(listening) >= 7
    before = everybody(flight)
    for name, endpoint in listening:
        for credentials in (tmp_path / "strangers" / "uav1", tmp_path / "strangers" / name, None):
            dial(endpoint, credentials)
    wanted = {name: before[name].refused + 3 for name, _ in listening}
    tower.wait(lambda seen: {name: seen[name].refused for name in wanted if name in seen} == wanted)
    with fleet.insider("uav1"):  # a good certificate is not refused
        assert {name: everybody(flight)[name].refused for name in wanted} == wanted
    for name, _ in listening:
        for reason in ("invalid peer certificate", "sent no certificates"):
            assert fleet.log(name).count(reason) == 1, (name, fleet.log(name))


def test_junk_on_every_key_is_counted_and_the_flight_continues(flight: Flight) -> None:
    fleet, tower = flight
    before = everybody(flight)
    tries, dice, sent = 100, random.Random(1), Counter()
    for insider in ("gateway", "kinematics", "uav1", "operator"):
        with fleet.insider(insider) as session:
            for _ in range(tries):
                for key in fleet.plan.publishes[insider]:
                    text = fleet.plan.text(key)
                    session.put(text, dice.randbytes(dice.randrange(120)), attachment=dice.randbytes(33))
                    sent[text] += 1
                time.sleep(0.01)
    expected = {
        "uav2": ("paper/uav2/pose", "paper/uav2/nearby", "paper/uav2/telemetry", "paper/uav1/estimate", "paper/stop"),
        "kinematics": ("paper/uav1/command", "paper/stop"),
        "gateway": ("paper/uav3/truth",),
    }
    assert {sent[text] for texts in expected.values() for text in texts} == {tries}

    def malformed(seen: dict[str, Status]) -> list[int]:
        counts = {name: dict(seen[name].rejected) for name in expected}
        return [counts[name].get(f"{text} malformed", 0) for name, texts in expected.items() for text in texts]

    wanted = [count + tries for count in malformed(before)]
    tower.wait(lambda seen: seen.keys() >= expected.keys() and malformed(seen) == wanted)


def test_a_recorded_flight_played_back_by_an_insider_moves_no_drone(flight: Flight) -> None:
    fleet, tower = flight
    recorded: list[tuple[str, bytes, bytes]] = []
    overhear(fleet, lambda *sample: recorded.append(sample), 4.0)
    tower.settled(0.03)
    before = rejections(everybody(flight))
    sent: Counter[str] = Counter()
    worst = 0.0
    for insider in ("gateway", "kinematics", "uav1", "uav2"):
        keys = {fleet.plan.text(key) for key in fleet.plan.publishes[insider]}
        with fleet.insider(insider) as session:
            for place, (key, payload, attached) in enumerate(row for row in recorded if row[0] in keys):
                session.put(key, payload, attachment=attached, congestion_control=zenoh.CongestionControl.BLOCK)
                sent[key] += 1
                if place % 10 == 0:
                    time.sleep(0.005)
                if place % 50 == 0:
                    seen = tower.wait(lambda seen: all(name in seen for name in FOLLOWERS))
                    worst = max(worst, *(seen[name].report.formation_error for name in FOLLOWERS))
    assert worst < 0.03
    wanted = {reader: sent[reader[1]] for reader in readers(fleet, sent)}
    assert len(wanted) > 20
    assert min(wanted.values()) > 30
    tower.wait(lambda seen: counted_of(wanted, rejections(seen) - before) == wanted)
    time.sleep(0.5)
    assert counted_of(wanted, rejections(everybody(flight)) - before) == wanted


def counted_of(wanted: Collection[tuple[str, str]], counted: Counter[tuple[str, str]]) -> dict[tuple[str, str], int]:
    """Return the counts of those wanted."""
    return {reader: counted[reader] for reader in wanted}


def within_quota(fleet: Fleet, insider: str) -> Iterator[str]:
    """Yield keys to put something on: all by turns, each as often as its quota bears beside genuine messages."""
    rates = {key: ROWS[key.kind].rate for key in fleet.plan.publishes[insider]}
    left = Counter({key: 4200 if rate >= 1000 else 2 * rate for key, rate in rates.items()})
    while left := +left:
        for key in left:
            yield fleet.plan.text(key)
            left[key] -= 1


@pytest.mark.long
def test_a_hundred_thousand_payloads_end_no_process_and_delay_no_step(flight: Flight) -> None:
    fleet, tower = flight
    genuine: dict[str, bytes] = {}
    overhear(fleet, lambda key, payload, _: genuine.setdefault(key, payload), 1.0)
    assert len(genuine) > 30
    before = rejections(everybody(flight))
    dice, sent = random.Random(7), Counter()
    for insider in ("gateway", "kinematics", "leader", *FOLLOWERS, "operator"):
        with fleet.insider(insider) as session:
            for k, text in enumerate(within_quota(fleet, insider)):
                payload = bytearray(genuine.get(text, b"")) if k % 2 else bytearray(dice.randbytes(dice.randrange(200)))
                if payload:
                    payload[dice.randrange(len(payload))] ^= 1 << dice.randrange(8)
                attached = dice.randbytes(33)
                session.put(text, bytes(payload), attachment=attached, congestion_control=zenoh.CongestionControl.BLOCK)
                sent[text] += 1
                if k % 20 == 19:
                    time.sleep(0.004)
    assert sent.total() >= 100_000
    tower.all_in("formation")
    wanted = {reader: sent[reader[1]] for reader in readers(fleet, sent)}
    assert len(wanted) > 30

    def counted(seen: dict[str, Status]) -> dict[tuple[str, str], int]:
        return counted_of(wanted, rejections(seen) - before)

    with contextlib.suppress(AssertionError):  # the counts say more
        tower.wait(lambda seen: counted(seen) == wanted)
    assert counted(everybody(flight)) == wanted
