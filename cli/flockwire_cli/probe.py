"""`flockwire probe`: proves on a running swarm that the wire refuses whatever key table and graph do not allow.

Attackers take turns: no certificate, another authority's, an expired one, then each identity's own, each as peer,
client and router, dialling every endpoint. What they hear they note themselves. What they say are canaries, which every
process drops and counts; so the statuses tell who let them in.
"""

from __future__ import annotations

import asyncio
import json
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from datetime import timedelta
from pathlib import Path

from flockwire import clock
from flockwire.config import Swarm
from flockwire.credentials import Credentials
from flockwire.keys import Key, all_keys, key_text
from flockwire.messages import Mission
from flockwire.nanoseconds import BILLION
from flockwire.pki import Signer, alternative_names, issue, new_authority, read_authority, save
from flockwire.session import RouterAbsentError, Session, connect
from flockwire.wiring import OPERATOR, identities

from flockwire_cli.attackers import MODES, POLL, Attack, Attacker
from flockwire_cli.matrix import OUTSIDERS, Finding, Observation, as_json, draw, findings
from flockwire_cli.operator import Operator
from flockwire_cli.processes import Children, PortInUseError, busy_endpoint

HEARING = 0.6  # s, longer than the gateway takes to repeat an order
ANSWER_TIME = 1.5  # s for a swarm that runs to answer
START_TIME = 10.0  # s for it to start
WAITING = ("grounded", "waiting")
SETTLING = 0.3  # s, longer than two statuses take

Lettings = dict[tuple[Key, str], int]


def attackers(swarm: Swarm, keys: Path, scratch: Path) -> Iterator[tuple[Attacker, ...]]:
    """Yield all attackers, those with one certificate together; forged certificates go into the folder `scratch`.

    Raises FileNotFoundError where the authority's key, which signs the expired one, is kept elsewhere.
    """
    now, victim = clock.utc(), identities(swarm)[-1]
    names = alternative_names(swarm, victim)
    long_ago, yesterday = now - timedelta(days=90), now - timedelta(days=1)
    foreign: Signer = new_authority(swarm.name, now)
    save(issue(foreign, victim, names, long_ago, now + timedelta(days=1)), scratch, "foreign")
    save(issue(read_authority(keys), victim, names, long_ago, yesterday), scratch, "expired")
    forged = (None, _files(keys, scratch, "foreign"), _files(keys, scratch, "expired"))
    shown = dict(zip(OUTSIDERS, forged, strict=True)) | {name: _files(keys, keys, name) for name in identities(swarm)}
    for name, credentials in shown.items():
        yield tuple(Attacker(name, credentials, mode) for mode in MODES)


def probe(
    swarm: Swarm, keys: Path, operator: Operator, tell: Callable[[str], None]
) -> tuple[list[Observation], list[Finding]]:
    """Attack the swarm that `operator` watches; returns what was seen and how it differs from what is allowed."""
    observations: list[Observation] = []
    found = [
        Finding(identity, "", "silent", "", "", leak=False)
        for identity in identities(swarm)[:-1]
        if identity not in _alive(operator)
    ]
    with tempfile.TemporaryDirectory() as scratch:
        for group in attackers(swarm, keys, Path(scratch)):
            alive = _alive(operator)
            for observation in _attack(swarm, keys, group, operator):
                observations.append(observation)
                new = list(findings(swarm, observation, alive & _alive(operator)))
                found += new
                for finding in new:
                    tell(finding.sentence())
    return observations, found


async def run(swarm: Swarm, swarm_file: Path, keys: Path, out: Path) -> list[Finding]:
    """Probe the swarm, after starting it where it does not run yet; returns all findings, after printing them.

    Raises CredentialsError, FileNotFoundError without the authority's key, PortInUseError.
    """
    children = None
    session = None
    try:
        if not await _runs(swarm, keys):
            children = Children(swarm_file, out, keys)
            busy = busy_endpoint(swarm, identities(swarm)[:-1])
            if busy:
                raise PortInUseError(busy)
            print(f"flockwire: {swarm.name} does not run: starting it, on the ground")
            for identity in identities(swarm)[:-1]:
                await children.start(identity)
        session = await connect(swarm, OPERATOR, keys, asyncio.Event())
        assert session is not None  # noqa: S101  (only the event that nobody sets would make it so)
        operator = Operator(swarm, session)
        for line in await asyncio.to_thread(_await_all, swarm, operator):
            print(f"flockwire: note: {line}")
        if children is not None:  # an order that means nothing on the ground, for the gateway to repeat
            operator.order(Mission(clock.now(), swarm.frame, "land"))
        began = time.monotonic()
        observations, found = await asyncio.to_thread(probe, swarm, keys, operator, print)
        write(swarm, observations, found, time.monotonic() - began, out)
        return found
    finally:
        if session is not None:
            session.close()
        if children is not None:
            await children.end()


async def _runs(swarm: Swarm, keys: Path) -> bool:
    """Return whether somebody of the swarm answers."""
    try:
        session = Session(swarm, OPERATOR, keys)
    except RouterAbsentError:
        return False
    with session:
        operator = Operator(swarm, session)
        await asyncio.to_thread(_watch, operator, ANSWER_TIME)
        return bool(operator.statuses)


def _await_all(swarm: Swarm, operator: Operator) -> list[str]:
    """Wait until the whole swarm is up and exchanges what it has to; returns what still was not so after START_TIME."""
    wanted = identities(swarm)[:-1]
    deadline = time.monotonic() + START_TIME
    while time.monotonic() < deadline:
        alive = _alive(operator)
        waiting = [i for i in wanted if i not in alive or operator.statuses[i].report.phase in WAITING]
        if not waiting:
            return []
        time.sleep(POLL)
    told = {name: operator.statuses[name].report.detail for name in _alive(operator)}
    return [f"{name}: {told.get(name) or 'does not answer'}" for name in waiting]


def write(swarm: Swarm, observations: list[Observation], found: list[Finding], seconds: float, out: Path) -> None:
    """Print the matrix and write it as probe.json into the folder `out`."""
    print("\n".join(draw(swarm, observations)))
    out.mkdir(parents=True, exist_ok=True)
    results = as_json(swarm, observations, found, seconds)
    (out / "probe.json").write_text(json.dumps(results, indent=2) + "\n", encoding="utf-8")
    leaks = sum(finding.leak for finding in found)
    cells = 2 * len(observations) * len(all_keys(swarm))
    print(
        f"flockwire: {leaks} leaks, {len(found) - leaks} blocked in {cells} tries by {len(observations)} attackers, "
        f"{seconds:.0f} s; {out / 'probe.json'}"
    )


def _attack(swarm: Swarm, keys: Path, group: tuple[Attacker, ...], operator: Operator) -> Iterator[Observation]:
    """Attack in all modes at once as far as hearing goes, and in turn with saying, so that it is known who said it."""
    with ExitStack() as stack:
        attacks = [stack.enter_context(Attack(swarm, attacker, str(keys / "ca.crt"))) for attacker in group]
        links = [attack.link() for attack in attacks]
        for attack in attacks:
            attack.listen()
        _watch(operator, HEARING)
        for attacker, attack, linked in zip(group, attacks, links, strict=True):
            before = _lettings(swarm, operator)
            attack.forge()
            _watch(operator, SETTLING)
            after = _lettings(swarm, operator)
            said = frozenset(cell for cell, count in after.items() if count > before.get(cell, 0))
            yield Observation(attacker.identity, attacker.mode, frozenset(attack.keys_heard()), said, linked)


def _watch(operator: Operator, seconds: float) -> None:
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        operator.poll()
        time.sleep(POLL)


def _alive(operator: Operator) -> frozenset[str]:
    now = operator.poll()
    return frozenset(name for name, status in operator.statuses.items() if now - status.stamp < BILLION)


def _lettings(swarm: Swarm, operator: Operator) -> Lettings:
    """Return how many canaries each process has let in, by key and receiver."""
    texts = {f"{key_text(swarm, key)} canary": key for key in all_keys(swarm)}
    return {
        (texts[name], status.identity): count
        for status in operator.statuses.values()
        for name, count in status.rejected
        if name in texts
    }


def _files(keys: Path, folder: Path, name: str) -> Credentials:
    return Credentials(keys / "ca.crt", folder / f"{name}.crt", folder / f"{name}.key")
