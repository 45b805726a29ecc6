"""How often the probe looks before it calls a key blocked."""

import asyncio

import pytest
from flockwire_lab.probe.attackers import Attacker
from flockwire_lab.probe.matrix import AttackResult, publishable, receivable
from flockwire_operator.station import probe
from flockwire_operator.station.operator import Operator
from simulated_pilots import SimulatedSwarm


@pytest.mark.parametrize(
    ("arrives", "looks", "blocked"), [(1, [1], False), (3, [1, 4, 4], False), (9, [1, 4, 4], True)]
)
def test_what_is_blocked_is_looked_at_again(make_plan, monkeypatch, tmp_path, arrives, looks, blocked):
    swarm, seen = SimulatedSwarm(make_plan()), []
    plan, nothing = swarm.plan, frozenset()

    def attack(plan, keys, group, operator, patience):
        seen.append(patience)
        late = len(seen) >= arrives
        received, published = receivable(plan, "uav1"), publishable(plan, "uav1")
        yield AttackResult("uav1", "peer", received if late else nothing, published if len(seen) == 1 else nothing, 1)

    monkeypatch.setattr(probe, "attackers", lambda *_: iter([(Attacker("uav1", None, "peer"),)]))
    monkeypatch.setattr(probe, "_attack", attack)
    monkeypatch.setattr(probe, "_alive", lambda _: frozenset(plan.started))

    async def attacked():
        return probe.probe(plan, tmp_path, Operator(swarm), lambda _: None)

    observations, found = asyncio.run(attacked())
    assert seen == looks
    assert len(observations) == 1
    assert bool(found) == blocked
