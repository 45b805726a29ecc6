"""Orders from two terminals and a console's page to real processes: the last one to come down holds, whoever gave it.

    .venv-dev/bin/python lab/bench/two_stations.py [--landings 100] [--sequences 200] [--busy] [--seed 0]

A landing: `flockwire start` in one terminal and 0.02 to 2 s later `flockwire land` in another, in the air, on the
ground and during take-off. A sequence: four to eight orders from both terminals and the page, 0.02 to 2 s apart, the
last one to hold or to land. A landing is lost when a drone is in the air in the end, or takes off again; a hold when
one is in formation.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import json
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Collection, Iterator
from pathlib import Path
from random import Random
from typing import Any

from aiohttp import ClientSession
from flockwire_core.domain.order import Answer, Order
from flockwire_core.ground.fleet import ON_GROUND
from flockwire_core.wire.phase import Phase
from stop import Bench, busy

SITUATIONS = ("in the air", "on the ground", "in take-off")
FLIGHTS = 40  # of one swarm: its batteries last for some 70
TRIES = 4  # to bring all where a sequence begins
REST = 20.0  # s in which all come to rest
LONGEST_ORDER = 40.0  # s until the page has answered an order
QUIET = 4.0  # s for which they must stay there: a drone that takes off again by itself did so after 2 s
TEXT = """name = "stations"
control = { rate_hz = 50 }
gateway = { rate_hz = 50 }
limits = { speed = 1.0, fence = { min = [-20.0, -20.0, -0.5], max = [20.0, 20.0, 4.0] } }
formation = { kind = "circle", radius = 1.5, rate = 0.2 }
formations = { wide = { kind = "circle", radius = 2.0, rate = 0.2 } }
leader = { trajectory = { kind = "constant", velocity = [0.0, 0.0, 0.0] } }
graph = { edges = [[0, 1], [0, 2]] }
drones = [
  { id = 0, start = [0.0, 0.0, 0.0] },
  { id = 1, start = [1.5, 0.0, 0.0] },
  { id = 2, start = [-1.5, 0.6, 0.0] },
]
"""


class Page:
    """A page of `flockwire console` with its token, held open by a thread of its own."""

    def __init__(self, swarm: Bench) -> None:
        line = [*_command("console", swarm), "--port", str(swarm.plan.swarm.network.base_port - 1000)]
        self.process = subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        assert self.process.stdout is not None
        self._link, _, self._token = self.process.stdout.readline().split()[-1].partition("#")
        self._asked = 0
        self._answers: list[str] = []
        self._loop = asyncio.new_event_loop()
        threading.Thread(target=self._loop.run_forever, daemon=True).start()
        self._socket: Any = self._run(self._open())

    def order(self, verb: str, formation: str) -> None:
        """Give an order by the page."""
        self._asked += 1
        self._run(self._socket.send_json({"order": verb, "formation": formation}))

    def answered(self) -> list[str]:
        """Wait until all orders are answered; return why each failed, empty if it did not."""
        deadline = time.monotonic() + LONGEST_ORDER
        while len(self._answers) < self._asked and time.monotonic() < deadline:
            time.sleep(0.02)
        answers = self._answers.copy()
        self._asked -= len(answers)
        self._answers.clear()
        return answers

    def close(self) -> None:
        """Close the page and end the console."""
        self._run(self._session.close())
        self._loop.call_soon_threadsafe(self._loop.stop)
        self.process.terminate()
        self.process.wait()

    async def _open(self) -> Any:  # noqa: ANN401  (aiohttp's)
        self._session = ClientSession()
        socket = await self._session.ws_connect(f"{self._link}live?token={self._token}")
        self._reading = asyncio.create_task(self._read(socket))
        return socket

    async def _read(self, socket: Any) -> None:  # noqa: ANN401
        async for message in socket:
            if answer := json.loads(message.data).get("answer"):
                self._answers.append(f"{answer['order']}: {answer['failed']}")

    def _run(self, work: Any) -> Any:  # noqa: ANN401
        return asyncio.run_coroutine_threadsafe(work, self._loop).result(20.0)


class Field:
    """A swarm that runs, two terminals and a page."""

    def __init__(self, swarm: Bench) -> None:
        self.swarm = swarm
        swarm.start(*swarm.plan.started)
        swarm.wait(lambda: self._fleet().all_in(Phase.READY))
        self.page = Page(swarm)
        self._terminals: list[subprocess.Popen[str]] = []

    def terminal(self, verb: str, formation: str = "") -> None:
        """Type an order in a terminal; do not wait for it."""
        line = _command(verb, self.swarm)
        if verb == "start" and formation:
            line += ["--formation", formation]
        if verb == "formation":
            line.insert(5, formation)
        self._terminals.append(subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True))

    def said(self) -> list[str]:
        """Wait for all terminals; return what they printed."""
        lines = [terminal.communicate(timeout=60.0)[0].strip() for terminal in self._terminals]
        self._terminals.clear()
        return lines

    def prepare(self, situation: str, formation: str) -> str:
        """Bring all drones there: on the ground, or into the other formation; return why they are not.

        On a busy machine a pilot may lose its pose meanwhile, which lands it: then all is tried again.
        """
        why = ""
        for _ in range(TRIES):
            if not (why := self._bring(situation, formation)):
                return ""
            print(f"again: {why}", flush=True)
        return why

    def _bring(self, situation: str, formation: str) -> str:
        orders = [("land", ""), ("start", formation)] if situation == "in the air" else [("land", "")]
        for verb, form in orders:
            answer = self._order(verb, form)
            with contextlib.suppress(TimeoutError):
                self.swarm.wait(self._down if verb == "land" else lambda: self._fleet().all_in(Phase.FORMATION), REST)
                continue
            return f"{verb} did not bring all there: {self.phases()}; {answer}"
        return ""

    def rest(self, phases: Collection[Phase], seconds: float = REST) -> str:
        """Wait until all are in `phases` and stay there; returns what is wrong, empty when nothing is."""
        with contextlib.suppress(TimeoutError):
            self.swarm.wait(lambda: self._fleet().all_in(*phases), seconds)
            with contextlib.suppress(TimeoutError):
                self.swarm.wait(lambda: not self._fleet().all_in(*phases), QUIET)
                return f"left it again: {self.phases()}"
            return ""
        return f"not at rest: {self.phases()}"

    def phases(self) -> dict[str, str]:
        """Return each pilot's phase, and the order that it obeys."""
        fresh = self._fleet().fresh.values()
        verbs = {s.identity: s.report.mission.verb if s.report.mission else "" for s in fresh}
        return {s.identity: f"{s.report.phase} ({verbs[s.identity]}) {s.report.detail}".strip() for s in fresh}

    def _order(self, verb: str, formation: str) -> Answer:
        answers: list[Answer] = []
        self.swarm.operator.ask(Order(verb, formation), 0.0, answers.append)
        return self.swarm.loop.run_until_complete(self.swarm.operator.run(lambda _: answers[0] if answers else None))

    def _down(self) -> bool:
        return self._fleet().all_in(*ON_GROUND) and not self._fleet().not_down()

    def _fleet(self) -> Any:  # noqa: ANN401
        return self.swarm.operator.core.fleet(self.swarm.operator.poll())


def landing(field: Field, situation: str, chance: Random) -> str:
    """Start in one terminal, land in the other; returns what was lost, empty when nothing was."""
    if why := field.prepare(situation, "wide"):
        return why
    if situation == "in take-off":
        field.terminal("start", "wide")
        field.swarm.wait(lambda: any(field._fleet().phase(i) == Phase.TAKEOFF for i in (0, 1, 2)), REST)
        time.sleep(chance.uniform(0.0, 1.5))
    gap = chance.uniform(0.02, 2.0)
    field.terminal("start")
    time.sleep(gap)
    field.terminal("land")
    lines = field.said()
    lost = field.rest(ON_GROUND)
    return f"{situation}, {gap:.2f} s apart: {lost}; {lines}" if lost else ""


def sequence(field: Field, chance: Random) -> str:
    """Give a sequence of orders; returns what was lost, empty when nothing was."""
    if why := field.prepare(chance.choice(SITUATIONS[:2]), ""):
        return why
    given = []
    for _ in range(chance.randint(3, 7)):
        verb = chance.choice(("start", "start", "formation", "hold", "land"))
        given.append((verb, chance.choice(("", "wide")) if verb in ("start", "formation") else "", chance.randrange(3)))
    given.append((chance.choice(("hold", "land", "land")), "", chance.randrange(3)))
    shown = []
    for verb, formation, giver in given:
        gap = chance.uniform(0.02, 2.0)
        time.sleep(gap)
        shown.append(f"{gap:.2f} s {('terminal A', 'terminal B', 'page')[giver]}: {verb} {formation}".strip())
        if giver == 2:
            field.page.order(verb, formation)
        else:
            field.terminal(verb, formation)
    phases = ON_GROUND if given[-1][0] == "land" else (*ON_GROUND, Phase.HOLD, Phase.LANDING)
    lines = field.said()
    lost = field.rest(tuple(phases))
    lines += field.page.answered()  # a start that is under way is not to meet the next sequence
    return f"{'; '.join(shown)}: {lost}; {lines}" if lost else ""


@contextlib.contextmanager
def field_of_two_stations() -> Iterator[Field]:
    """Make a swarm for as long as the context lasts."""
    with tempfile.TemporaryDirectory() as folder:
        swarm = Bench(Path(folder), TEXT)
        field = None
        try:
            field = Field(swarm)
            yield field
        finally:
            if field is not None:
                field.page.close()
            swarm.end()


def _command(verb: str, swarm: Bench) -> list[str]:
    return [sys.executable, "-m", "flockwire_operator", verb, str(swarm.file), "--keys", str(swarm.keys)]


def main() -> int:
    """Give all orders; returns 1 when one was lost."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--landings", type=int, default=100)
    parser.add_argument("--sequences", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--busy", action="store_true", help="keep all cores busy meanwhile")
    given = parser.parse_args()
    chance, lost = Random(given.seed), 0
    with busy() if given.busy else contextlib.nullcontext():
        landings = _flown(given.landings, lambda field, k: landing(field, SITUATIONS[k % 3], chance))
        sequences = _flown(given.sequences, lambda field, _: sequence(field, chance))
        for name, ends in (("landings", landings), ("sequences", sequences)):
            lost += _counted(name, ends)
    return 1 if lost else 0


def _flown(count: int, fly: Callable[[Field, int], str]) -> Iterator[str]:
    """Yield how each of `count` flights ended; a swarm flies FLIGHTS times, then its batteries are too low."""
    for first in range(0, count, FLIGHTS):
        with field_of_two_stations() as field:
            for k in range(first, min(first + FLIGHTS, count)):
                yield fly(field, k)


def _counted(name: str, ends: Iterator[str]) -> int:
    """Print what was lost, and how many every tenth; return how many."""
    lost = k = 0
    for k, what in enumerate(ends, 1):
        if what:
            lost += 1
            print(f"lost: {what}", flush=True)
        if k % 10 == 0:
            print(f"{name}: {lost} lost of {k}", flush=True)
    if k % 10:
        print(f"{name}: {lost} lost of {k}", flush=True)
    return lost


if __name__ == "__main__":
    sys.exit(main())
