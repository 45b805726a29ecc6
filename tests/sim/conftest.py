"""A virtual flight, and what was said in it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import pytest
from flockwire.flight.faults import parse_faults
from flockwire.nanoseconds import BILLION
from flockwire.swarm.model import Swarm
from flockwire.wire.messages import Message, Mission
from flockwire.wire.status import Status
from flockwire_sim.process import Said
from flockwire_sim.world import EPOCH, Outcome, World


@dataclass
class Flown:
    """A flight that is over: all that was said, in order, with s since the order to take off."""

    world: World
    outcome: Outcome
    said: list[tuple[float, Said, Message]] = field(default_factory=list)

    def of(self, kind: str, owner: str, begin: float = -99.0, end: float = 1e9) -> list[tuple[float, Message]]:
        """Return when what was said of a key between two moments."""
        return [(t, m) for t, said, m in self.said if said.key == (kind, owner) and begin <= t <= end]

    def phases(self, identity: str, begin: float = -99.0) -> list[tuple[float, str, str]]:
        """Return when a process told a new phase or reason."""
        told: list[tuple[float, str, str]] = []
        for t, status in self.of("status", identity, begin):
            assert isinstance(status, Status)
            state = (status.report.phase, status.report.detail)
            if not told or told[-1][1:] != state:
                told.append((t, *state))
        return told


@pytest.fixture(scope="session")
def fly(make_swarm: Callable[..., Swarm]) -> Callable[..., Flown]:
    """Fly the small swarm, changed, under faults."""

    def flight(changes: dict | None = None, *faults: dict, seed: int = 0, duration: float = 8.0) -> Flown:
        swarm = make_swarm(changes)
        heard: list[Said] = []
        world = World(swarm, seed, duration, parse_faults({"faults": list(faults)}, swarm, "test"), heard.append)
        flown = Flown(world, world.run())
        messages = [(said, said.sample.opened()[0]) for said in heard]
        off = next((said.at for said, m in messages if isinstance(m, Mission)), EPOCH)
        flown.said = [((said.at - off) / BILLION, said, message) for said, message in messages]
        return flown

    return flight
