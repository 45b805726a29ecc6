"""A leader that is steered in virtual time, until the link is lost."""

from flockwire_core.domain.time import SECOND
from flockwire_lab.operator import ScriptedSteering
from flockwire_lab.world import EPOCH

CHANGES = {"leader": {"kind": "teleoperated", "speed": 0.4}, "control.law": "extended"}


def test_the_formation_follows_a_steered_leader_and_stops_with_it(fly):
    lost = EPOCH + 9 * SECOND

    def script(now):
        return None if now > lost else (0.4, 0.0, 0.0) if now < EPOCH + 7 * SECOND else (0.0, 0.4, 0.0)

    flown = fly(
        CHANGES, duration=12.0, prepare=lambda world: world.seat("teleop", ScriptedSteering(world.swarm, script))
    )
    assert flown.outcome.failure == ""
    assert flown.differing() == {}
    places = [(p.at, message.position) for _, p, message in flown.published if p.key == ("truth", "uav0")]
    (x, y, _) = next(place for at, place in places if at >= lost + SECOND)
    assert x > 1.0
    assert y > 0.5
    end = next(place for at, place in places if at >= lost + 3 * SECOND)
    assert abs(end[0] - x) + abs(end[1] - y) < 0.05
    late = [status.report.formation_error for t, status in flown.of("status", "uav4", 9.0, 11.9)]
    assert max(late) < 0.1
