"""`flockwire probe`: proves on a running swarm that everything that key table and graph do not allow is refused.

Attackers take turns: no certificate, another authority's, an expired one, then each identity's own, each as peer,
client and router, dialling every endpoint. They record what they receive. They publish canaries, which every process
drops and counts, so the statuses show which process accepted them.
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

from flockwire_core import clock
from flockwire_core.domain.order import Order
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.runtime.session import RouterAbsentError, Session
from flockwire_core.security.files import files_of
from flockwire_core.security.pki import Signer, alternative_names, issue, new_authority, read_authority, save
from flockwire_core.wire.keys import Key
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.processes import OPERATOR
from flockwire_lab.probe.attackers import MODES, POLL, Attack, Attacker
from flockwire_lab.probe.matrix import OUTSIDERS, AttackResult, Deviation, as_json, deviations, draw

from flockwire_operator.station.host import Host
from flockwire_operator.station.operator import Operator
from flockwire_operator.station.processes import started
from flockwire_operator.station.terminal.interrupts import Interrupts
from flockwire_operator.station.terminal.progress import Show, progress

WAITING = (Phase.GROUNDED, Phase.WAITING)


def attackers(plan: Plan, keys: Path, scratch: Path) -> Iterator[tuple[Attacker, ...]]:
    """Yield all attackers, those with one certificate together; forged certificates go into the folder `scratch`.

    Raises FileNotFoundError if the authority's key, which signs the expired one, is kept elsewhere.
    """
    now, victim = clock.utc(), OPERATOR.kind
    names = alternative_names(plan, victim)
    long_ago, yesterday = now - timedelta(days=90), now - timedelta(days=1)
    foreign: Signer = new_authority(plan.swarm.name, now)
    save(issue(foreign, victim, names, long_ago, now + timedelta(days=1)), scratch, "foreign")
    save(issue(read_authority(keys), victim, names, long_ago, yesterday), scratch, "expired")
    forged = (None, files_of(scratch, "foreign"), files_of(scratch, "expired"))
    shown = dict(zip(OUTSIDERS, forged, strict=True)) | {name: files_of(keys, name) for name in plan.identities}
    for name, credentials in shown.items():
        yield tuple(Attacker(name, credentials, mode) for mode in MODES)


def probe(
    plan: Plan, keys: Path, operator: Operator, show: Callable[[str], None], advance: Show = lambda *_: None
) -> tuple[list[AttackResult], list[Deviation]]:
    """Attack the swarm that `operator` watches; returns the results and their deviations from the rules.

    `show` gets each deviation, `advance` the next attacker and the number of those done.
    """
    observations: list[AttackResult] = []
    found = [
        Deviation(identity, "", "silent", "", "", leak=False)
        for identity in plan.started
        if identity not in _alive(operator)
    ]

    with tempfile.TemporaryDirectory() as scratch:
        for count, group in enumerate(attackers(plan, keys, Path(scratch))):
            advance(f"attacks as {group[0].identity}", count)
            observed, new = _look(plan, keys, group, operator)
            observations += observed
            found += new
            for deviation in new:
                show(deviation.sentence())
    return observations, found


async def run(plan: Plan, swarm_file: Path, keys: Path, out: Path) -> list[Deviation]:
    """Probe the swarm, and start it first if it does not run; prints and returns all deviations.

    Raises CredentialsError, FileNotFoundError without the authority's key, PortInUseError, UnansweredError.
    """
    out.mkdir(parents=True, exist_ok=True)
    runs = await _runs(plan, keys)
    if not runs:
        print(f"flockwire: {plan.swarm.name} does not run: starting it, on the ground")
    host = Host(plan, swarm_file, next(iter(plan.swarm.hosts)), out, keys)
    async with started(host, () if runs else plan.started, OPERATOR.kind, Interrupts()) as (_, session):
        operator = Operator(session)
        operator.poll()  # its clock is corrected in this loop, not in the threads' loops
        for line in await asyncio.to_thread(_await_all, plan, operator):
            print(f"flockwire: note: {line}")
        if not runs:  # an order without effect on the ground, for the gateway to repeat
            operator.ask(Order("land"))
        began = clock.monotonic()
        with progress("probe", len(OUTSIDERS) + len(plan.identities)) as advance:
            observations, found = await asyncio.to_thread(probe, plan, keys, operator, print, advance)
        write(plan, observations, found, (clock.monotonic() - began) / SECOND, out)
        return found


async def _runs(plan: Plan, keys: Path) -> bool:
    """Return whether a process of the swarm answers."""
    answer_time = 1.5  # s for a running swarm to answer
    try:
        session = Session(plan, OPERATOR.kind, keys)
    except RouterAbsentError:
        return False
    with session:
        operator = Operator(session)
        operator.poll()
        await asyncio.to_thread(_watch, operator, answer_time)
        return bool(operator.statuses)


def _await_all(plan: Plan, operator: Operator) -> list[str]:
    """Wait until the whole swarm runs and exchanges its messages; returns what is missing after 10 s."""
    wanted = plan.started
    deadline = clock.monotonic() + nanoseconds(10.0)
    while clock.monotonic() < deadline:
        alive = _alive(operator)
        waiting = [i for i in wanted if i not in alive or operator.statuses[i].report.phase in WAITING]
        if not waiting:
            return []
        time.sleep(POLL)
    details = {name: operator.statuses[name].report.line for name in _alive(operator)}
    return [f"{name}: {details.get(name) or 'does not answer'}" for name in waiting]


def write(plan: Plan, observations: list[AttackResult], found: list[Deviation], seconds: float, out: Path) -> None:
    """Print the matrix and write it as probe.json into the folder `out`."""
    print("\n".join(draw(plan, observations)))
    results = as_json(plan, observations, found, seconds)
    (out / "probe.json").write_text(json.dumps(results, indent=2) + "\n", encoding="utf-8")
    leaks = sum(deviation.leak for deviation in found)
    cells = 2 * len(observations) * len(plan.keys)
    print(
        f"flockwire: {leaks} leaks, {len(found) - leaks} blocked in {cells} tries by {len(observations)} attackers, "
        f"{seconds:.0f} s; {out / 'probe.json'}"
    )


def _look(
    plan: Plan, keys: Path, group: tuple[Attacker, ...], operator: Operator
) -> tuple[list[AttackResult], list[Deviation]]:
    """Attack until nothing is blocked, three times at most; returns the results and their deviations."""
    alive, observed, found = _alive(operator), list[AttackResult](), list[Deviation]()
    for patience in (1, 4, 4):  # times as long: a busy machine is not a refusal
        seen = list(_attack(plan, keys, group, operator, patience))
        observed = [first | second for first, second in zip(observed or seen, seen, strict=True)]
        living = alive & _alive(operator)
        found = [deviation for one in observed for deviation in deviations(plan, one, living)]
        if all(deviation.leak for deviation in found):
            break
    return observed, found


def _attack(
    plan: Plan, keys: Path, group: tuple[Attacker, ...], operator: Operator, patience: int
) -> Iterator[AttackResult]:
    """Receive in all modes at once, but publish in one after the other, to know the publisher."""
    receiving = 0.6  # s, longer than the gateway takes to repeat an order
    settling = 0.3  # s, longer than two statuses take
    with ExitStack() as stack:
        attacks = [stack.enter_context(Attack(plan, attacker, str(keys / "ca.crt"), patience)) for attacker in group]
        links = [attack.link() for attack in attacks]
        for attack in attacks:
            attack.subscribe()
        _watch(operator, patience * receiving)
        for attacker, attack, linked in zip(group, attacks, links, strict=True):
            before = _accepted(plan, operator)
            attack.forge()
            _watch(operator, patience * settling)
            after = _accepted(plan, operator)
            published = frozenset(cell for cell, count in after.items() if count > before.get(cell, 0))
            yield AttackResult(attacker.identity, attacker.mode, frozenset(attack.keys_received()), published, linked)


def _watch(operator: Operator, seconds: float) -> None:
    deadline = clock.monotonic() + nanoseconds(seconds)
    while clock.monotonic() < deadline:
        operator.poll()
        time.sleep(POLL)


def _alive(operator: Operator) -> frozenset[str]:
    now = operator.poll()
    return frozenset(name for name, status in operator.statuses.items() if now - status.stamp < SECOND)


def _accepted(plan: Plan, operator: Operator) -> dict[tuple[Key, str], int]:
    """Return how many canaries each process has accepted, by key and receiver."""
    texts = {f"{plan.text(key)} canary": key for key in plan.keys}
    return {
        (texts[name], status.identity): count
        for status in operator.statuses.values()
        for name, count in status.rejected
        if name in texts
    }
