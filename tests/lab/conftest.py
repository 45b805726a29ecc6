"""A virtual flight, and what was published in it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import pytest
from flockwire_core.domain.order import Mission
from flockwire_core.domain.time import SECOND
from flockwire_core.wire.codec import Message, decode
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.status import Status
from flockwire_lab.faults.file import parse_faults
from flockwire_lab.process import Published
from flockwire_lab.world import EPOCH, Outcome, World


@dataclass
class Flown:
    """A flight that is over: all that was published, in order, with s since the order to take off."""

    world: World
    outcome: Outcome
    published: list[tuple[float, Published, Message]] = field(default_factory=list)

    def of(self, kind: str, owner: str, begin: float = -99.0, end: float = 1e9) -> list[tuple[float, Message]]:
        """Return the messages of a key between two moments, each with its time."""
        return [(t, m) for t, published, m in self.published if published.key == (kind, owner) and begin <= t <= end]

    def phases(self, identity: str, begin: float = -99.0) -> list[tuple[float, str, str]]:
        """Return when a process reported a new phase or reason."""
        told: list[tuple[float, str, str]] = []
        for t, status in self.of("status", identity, begin):
            assert isinstance(status, Status)
            state = (status.report.phase, status.report.line)
            if not told or told[-1][1:] != state:
                told.append((t, *state))
        return told

    def differing(self) -> dict[str, tuple[str, str]]:
        """Return the first published message of each kind that its bytes do not give again, and what they give."""
        differing: dict[str, tuple[str, str]] = {}
        for _, published, message in self.published:
            arrived = decode(type(message), published.sample.payload)
            if repr(arrived) != repr(message) or hash(arrived) != hash(message):  # only what cannot change has a hash
                differing.setdefault(published.key.kind, (repr(message), repr(arrived)))
        return differing


@pytest.fixture(scope="session")
def fly(make_plan: Callable[..., Plan]) -> Callable[..., Flown]:
    """Fly the small swarm, changed, under faults; `prepare` gets the world before it begins."""

    def flight(
        changes: dict | None = None, *faults: dict, seed: int = 0, duration: float = 8.0,
        prepare: Callable[[World], object] = lambda _: None,
    ) -> Flown:  # fmt: skip
        plan = make_plan(changes)
        seen: list[Published] = []
        world = World(plan.swarm, seed, duration, parse_faults({"faults": list(faults)}, plan, "test"), seen.append)
        prepare(world)
        flown = Flown(world, world.run())
        messages = [(published, published.message) for published in seen]
        off = next((published.at for published, m in messages if isinstance(m, Mission)), EPOCH)
        flown.published = [((published.at - off) / SECOND, published, message) for published, message in messages]
        return flown

    return flight
