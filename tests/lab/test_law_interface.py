"""What a law declares is what it gets, and what it sends arrives: over the encoded messages of virtual time."""

from __future__ import annotations

import sys
from collections.abc import Callable
from itertools import pairwise
from math import hypot
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from flockwire_core.domain.motion import LeaderMotion
from flockwire_core.domain.time import SECOND
from flockwire_core.dry_flight import START
from flockwire_core.law import Decision, Information, LawSettings, Observation, Output, Pace, Sense
from flockwire_core.loading import SwarmFileError
from flockwire_core.own_law import law_check
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.wire.keys import Key
from flockwire_core.wire.law_form import FormError, LawForm, law_form
from flockwire_core.wire.plan import Plan
from flockwire_lab.flight import Flight, fly_recorded
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

BOTH = [[0, 1], [1, 2], [2, 1], [2, 3], [3, 2], [3, 4]]


class Word(NamedTuple):
    """A message with all that one may hold."""

    place: tuple[float, float, float]
    round: int
    parts: tuple[tuple[float, int], float]


class Law:
    """Flies by relative positions, with arrays."""

    information = Information(neighbours=Sense.POSITION, leaders=(0, 1))
    seen: list[tuple[int, Observation]]  # by drone

    def __init__(self, settings: LawSettings) -> None:
        self.number, self.round = settings.number, 0

    def command(self, o: Observation) -> Any:
        assert o.place is not None
        gaps = [np.array(one.position) + o.place.to(one.number, o.t) for one in o.neighbours]
        return o.place.rate(o.t) + np.sum(gaps, axis=0) if gaps else np.zeros(3)

    def step(self, o: Observation) -> Decision:
        if abs(o.now - START) > SECOND:  # not a dry step
            type(self).seen.append((self.number, o))
        return Decision(self.command(o)) if o.place is not None else Decision()


class Bearings(Law):
    information = Information(neighbours=Sense.BEARING, leaders=(0, 1))

    def command(self, o: Observation) -> Any:
        return np.zeros(3)


class Around(Bearings):
    information = Information(around=Sense.DISTANCE | Sense.VELOCITY, radius=4.0, leaders=(0, 1))


class Bothways(Bearings):
    information = Information(neighbours=Sense.POSITION, leaders=(0, 1))


class Nothing(Bearings):
    information = Information(leaders=(0, 1))


class Accelerating(Law):
    information = Information(neighbours=Sense.POSITION | Sense.VELOCITY, output=Output.ACCELERATION, leaders=(0, 1))

    def command(self, o: Observation) -> Any:
        rates = [np.array(one.velocity) for one in o.neighbours]
        return super().command(o) + 2.0 * np.sum(rates, axis=0) if rates else np.zeros(3)


class Rounds(Law):
    """A round ends when all neighbours have sent theirs."""

    information = Information(neighbours=Sense.POSITION, message=Word, pace=Pace.ROUND, leaders=(0, 1))

    def step(self, o: Observation) -> Decision:
        decision, followers = super().step(o), [one for one in o.heard if not one.leads]
        if o.place is None or any(one.content.round < self.round for one in followers):
            return decision
        self.round += 1
        return Decision(decision.command, Word((o.t, 0.0, 0.0), self.round, ((1.0, 2), 3.0)))


class Planned(Law):
    information = Information(neighbours=Sense.POSITION, deadline=0.05, leaders=(0, 1))

    def plan(self, o: Observation) -> int:
        return o.now


@pytest.fixture
def fly_law(fly: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> Callable[..., Any]:
    """Fly a law of this file over links in both directions."""
    monkeypatch.setitem(sys.modules, "interface_law", sys.modules[__name__])

    def flight(law: type[Law], changes: dict[str, Any] | None = None, **more: Any) -> Any:
        Law.seen = law.seen = []
        given = {"control.law": f"interface_law:{law.__name__}", "graph.edges": BOTH, **(changes or {})}
        return fly(given, **more)

    return flight


def sightings(flown: Any, number: int) -> list[Any]:
    found = [message for _, message in flown.of("seen", uav(number), 1.0)]
    assert len(found) > 100
    return found


def test_a_law_sees_bearings_of_its_in_neighbours_and_nothing_else(fly_law: Callable[..., Any]) -> None:
    flown = fly_law(Bearings, duration=3.0)
    for sighting in sightings(flown, 2):
        assert {one.number for one in sighting.neighbours} <= {1, 3}
        assert sighting.around == ()
        for one in sighting.neighbours:
            assert hypot(*one.bearing) == pytest.approx(1.0)
            assert (one.distance, one.position, one.velocity) == (None, None, None)
    last = Bearings.seen[-1][1]
    assert (last.position, last.velocity, last.motion) == (None, None, None)
    assert not (last.bodies or last.heard or last.around)


def test_who_is_around_has_no_number_unless_the_law_asks(fly_law: Callable[..., Any]) -> None:
    flown = fly_law(Around, duration=3.0)
    assert flown.outcome.failure == ""
    near = [one for s in sightings(flown, 2) for one in s.around]
    assert near
    assert {one.number for one in near} == {-1}
    assert all(0.0 < one.distance < 4.0 and one.position is None and one.velocity is not None for one in near)


def test_a_law_that_declares_nothing_receives_nothing(
    fly_law: Callable[..., Any], make_swarm: Callable[..., Swarm]
) -> None:
    flown = fly_law(Nothing, duration=1.0)
    plan = Plan(flown.world.plan.swarm)
    received = {key.kind for i in range(1, 5) for key in plan.subscribes[uav(i)]}
    assert received == {"pose", "nearby", "telemetry", "mission", "stop"}  # its own, for its pilot
    assert all(key.owner in ("", uav(i), "gateway") for i in range(1, 5) for key in plan.subscribes[uav(i)])


def test_both_ends_of_an_edge_are_of_one_time(fly_law: Callable[..., Any]) -> None:
    flown = fly_law(Law, duration=4.0)
    one, other = (
        {s.stamp: n.position for s in sightings(flown, i) for n in s.neighbours if n.number == j}
        for i, j in ((2, 3), (3, 2))
    )
    assert len(one.keys() & other.keys()) > 100
    for stamp in one.keys() & other.keys():
        assert one[stamp] == tuple(-x for x in other[stamp])


def test_the_noise_of_sensing_is_in_what_laws_see_and_differs_at_both_ends(fly_law: Callable[..., Any]) -> None:
    flown = fly_law(Bothways, {"sensing.noise": 0.02}, duration=6.0)
    one, other = (
        {s.stamp: n.position for s in sightings(flown, i) for n in s.neighbours if n.number == j}
        for i, j in ((2, 3), (3, 2))
    )
    sums = np.array([np.add(one[stamp], other[stamp]) for stamp in one.keys() & other.keys()])
    assert np.std(sums, axis=0) == pytest.approx([0.02 * 2**0.5] * 3, rel=0.15)
    assert np.abs(sums.mean(axis=0)).max() < 0.005
    assert flown.outcome.failure == ""


def test_accelerations_and_arrays_fly(fly_law: Callable[..., Any]) -> None:
    flown = fly_law(Accelerating, {"limits.acceleration": 5.0, "formation.rate": 0.0}, duration=13.0)
    assert flown.outcome.failure == ""
    last = [o for number, o in Accelerating.seen if number == 1 and o.place is not None][-1]
    (leader,) = (one for one in last.neighbours if one.leads)
    gap = np.array(leader.position) + last.place.to(0, last.t)
    assert np.linalg.norm(gap[:2]) < 0.3


def test_an_airframe_that_takes_accelerations_gets_the_change_of_its_velocity(fly_law: Callable[..., Any]) -> None:
    mixed = {"formation.rate": 0.0, "drones.1.airframe": "multirotor", "avoidance.sensing_radius": 3.0}
    flown = fly_law(Accelerating, mixed, duration=8.0)
    commands = [m for _, m in flown.of("command", "uav1", 6.0)]
    pairs = [(m.acceleration[0], 100.0 * (m.velocity[0] - last.velocity[0])) for last, m in pairwise(commands)]
    pairs = [pair for pair in pairs if pair[0] != 0.0]  # it lands by velocities
    assert len(pairs) > 50
    assert all(acceleration == pytest.approx(change, abs=1e-6) for acceleration, change in pairs)
    assert all(m.acceleration == (0.0, 0.0, 0.0) for _, m in flown.of("command", "uav2"))


def test_rounds_arrive_in_order_without_a_gap_over_a_lossy_network_and_twice_the_same(
    fly_law: Callable[..., Any],
) -> None:
    flights = []
    for _ in range(2):
        fly_law(Rounds, {"sim.loss": 0.1}, duration=4.0)
        flights.append([(n, h.number, h.sequence, h.content) for n, o in Rounds.seen for h in o.news])
        assert max(o.news[-1].content.round for _, o in Rounds.seen if o.news) > 50
        for i, j in ((1, 2), (2, 1), (2, 3), (3, 2)):
            numbers = [sequence for n, number, sequence, _ in flights[-1] if (n, number) == (i, j)]
            assert numbers == list(range(1, len(numbers) + 1))
    assert flights[0] == flights[1]


def test_a_plan_counts_exactly_at_its_deadline(fly_law: Callable[..., Any]) -> None:
    fly_law(Planned, duration=4.0)
    ages = [o.now - o.plan for _, o in Planned.seen if o.plan is not None and o.place is not None]
    assert len(ages) > 50
    assert min(ages) >= 50_000_000
    assert max(ages) < 120_000_000


def test_a_message_is_packed_and_unpacked() -> None:
    form = LawForm(Word)
    word = Word((1.0, 2.0, -3.5), -7, ((0.5, 9), 1e-9))
    assert form.unpack(form.pack(word)) == word
    assert form.size == 56
    assert form.unpack(form.pack(Word(np.ones(3), 1, ((np.float32(1), 2), 3)))) == Word((1.0,) * 3, 1, ((1.0, 2), 3.0))  # type: ignore[arg-type]
    for wrong in (Word((1.0, 2.0), 1, ((1.0, 2), 3.0)), Word((1.0, 2.0, float("nan")), 1, ((1.0, 2), 3.0)), (1.0, 2)):
        with pytest.raises((ValueError, TypeError)):
            form.pack(wrong)


class Endless(NamedTuple):
    names: list[float]


class Open(NamedTuple):
    row: tuple[float, ...]


class Row(NamedTuple):
    row: tuple[float, float, float, float]


Wide = NamedTuple("Wide", [(f"f{k}", Row.__annotations__ and tuple[(float,) * 100]) for k in range(11)])  # type: ignore[misc]


@pytest.mark.parametrize(
    ("kind", "line"),
    [
        (Endless, "Endless.names: list"),
        (Open, "has no fixed size"),
        (dict, "must be a NamedTuple"),
        (Wide, "takes 8800 bytes, at most 8192"),
        (NamedTuple("Twice", [("row", float), ("Row", float)]), "its fields must differ in lower case"),
        (NamedTuple("Valid", [("valid_at", float)]), "none be 'valid_at'"),
    ],
)
def test_a_type_without_a_fixed_size_is_no_message(kind: type, line: str) -> None:
    with pytest.raises(FormError, match=line):
        law_form(Information(message=kind))


class Symmetric(Nothing):
    information = Information(neighbours=Sense.BEARING, directed=False, leaders=(0, 1))


class Telling(Nothing):
    """Sends what it does not declare."""

    def step(self, o: Observation) -> Decision:
        return Decision(message=Word((0.0, 0.0, 0.0), 1, ((1.0, 2), 3.0)))


class Unplanned(Planned):
    def plan(self, o: Observation) -> int:
        raise ArithmeticError("no solution")


class Never(Nothing):
    """Its plan is never computed: no deadline."""

    def plan(self, o: Observation) -> int:
        return 1


class Spelling(Nothing):
    information = Information(message=Row, leaders=(1, 1))

    def step(self, o: Observation) -> Decision:
        return Decision(message=Row((0.0, 0.0, 0.0, "x")))  # type: ignore[arg-type]


class Wording(Nothing):
    information = Information(output="acceleration")  # type: ignore[arg-type]


class Counted(NamedTuple):
    count: int


class Counting(Nothing):
    information = Information(message=Counted, leaders=(0, 1))

    def step(self, o: Observation) -> Decision:
        return Decision(message=Counted("one"))  # type: ignore[arg-type]


class Leading(Counting):
    def step(self, o: Observation) -> Decision:
        return Decision(message=Counted(1))

    def lead(self, t: float, motion: LeaderMotion) -> Counted:
        return Counted(1)


class Listing(Nothing):
    information = Information(message=Endless)


class Behind(Nothing):
    information = Information(around=Sense.POSITION, radius=-1.0)


class Impatient(Nothing):
    information = Information(message=Row, silence=0.0)


class Endlessly(Nothing):
    information = Information(deadline=float("inf"))


class Compass(Nothing):
    information = Information(own=Sense.BEARING)


class Backwards(Nothing):
    information = Information(leaders=(2, 0))


class Heavy(Nothing):
    information = Information(message=Wide)


class Within(Nothing):
    information = Information(neighbours=Sense.POSITION, radius=2.0)


class Roundless(Nothing):
    information = Information(pace=Pace.ROUND)


class Led3(Nothing):
    information = Information(leaders=(3, 3))


@pytest.mark.parametrize(
    ("law", "changes", "line"),
    [
        (Symmetric, {"graph.edges": [[0, 1], [1, 2], [2, 3], [3, 4]]}, r"add the edge \[2, 1\] to graph.edges"),
        (Symmetric, {"graph.edges": [[0, 1], [1, 2], [2, 1, 0.5], [2, 3], [3, 2], [3, 4], [4, 3]]}, "symmetric graph"),
        (Telling, {}, "its information declares none"),
        (Unplanned, {}, "flies in formation: ArithmeticError: no solution"),
        (Never, {}, "a method plan and a deadline > 0"),
        (Spelling, {}, "message field row = 'x': must be a finite number$"),
        (Wording, {}, "information has output = 'acceleration', must be of the type Output"),
        (Counting, {}, "message field count = 'one': must be a whole number"),
        (Leading, {}, r"its class method lead\(t, motion\) fails: TypeError: .*missing 1 required positional argument"),
        (Listing, {}, "has no fixed size"),
        (Behind, {}, r"information has radius = -1\.0, must be 0 to 1000 m"),
        (Impatient, {}, r"information has silence = 0\.0, must be more than 0 s"),
        (Endlessly, {}, "information has deadline = inf, must be 0 to 60 s"),
        (Compass, {}, "information has own = .*, must be of POSITION and VELOCITY"),
        (Backwards, {}, r"information has leaders = \(2, 0\), must be two whole numbers, the least and the most"),
        (Heavy, {}, "message Wide takes 8800 bytes, at most 8192 may be sent"),
        (Led3, {}, "needs 3, the file has 1"),
        (Within, {}, "has a radius, but nothing around is declared within it: add around, or drop the radius"),
        (Roundless, {}, "has pace = ROUND, but no message that goes at it: declare its type"),
        (Bearings, {"graph.edges": [[0, 1], [1, 2, -0.5], [2, 3], [3, 4]]}, "takes weights above 0 only"),
        (Around, {"avoidance.sensing": "neighbours"}, "avoidance.sensing = 'neighbours' has no sensor"),
        (Bearings, {"avoidance.sensing": "neighbours"}, "may not know its neighbours' positions"),
    ],
)
def test_a_law_that_cannot_be_flown_is_refused_in_one_line(
    law: type[Law], changes: dict[str, Any], line: str, make_swarm: Callable[..., Swarm],
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.setitem(sys.modules, "interface_law", sys.modules[__name__])
    Law.seen = []
    with pytest.raises(SwarmFileError, match=line) as caught:
        make_swarm({"control.law": f"interface_law:{law.__name__}", **changes})
    assert "control.law" in str(caught.value)


def test_keys_follow_from_the_declaration(make_plan: Callable[..., Plan], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "interface_law", sys.modules[__name__])
    Law.seen = []
    plan = make_plan({"control.law": "interface_law:Rounds", "graph.edges": BOTH})
    assert plan.subscribers(Key("law", "uav2")) == ("uav1", "uav3")
    assert plan.subscribers(Key("seen", "uav2")) == ("uav2",)
    assert not any(key.kind in ("estimate", "bids") for key in plan.keys)
    assert "uav1" not in plan.subscribers(Key("pose", "uav0"))


class Led(Law):
    """Hears the leader's message; predicts nothing."""

    information = Information(neighbours=Sense.POSITION, message=Word, leaders=(1, 1))

    @staticmethod
    def lead(t: float, motion: LeaderMotion) -> Word:
        return Word(motion.position, round(1000 * t), ((motion.velocity[0], 2), motion.acceleration[0]))

    @classmethod
    def check(cls, graph: Any, places: Any, parameters: Any) -> Any:
        return ["the graph is too thin"], ["thin"], {"slowest": 0.25 * len(places)}


def test_a_leader_sends_what_the_law_has_it_send(fly_law: Callable[..., Any]) -> None:
    flown = fly_law(Led, duration=6.0)
    heard = [h for n, o in Led.seen if n == 1 and o.place is not None for h in o.heard if h.leads]
    assert len(heard) > 100
    assert heard[-1].content.round > 1000
    assert heard[-1].content.parts[0][0] == pytest.approx(0.1, abs=0.02)  # m/s, of its path
    assert flown.of("law", "uav0")
    assert not any(h.leads for n, o in Led.seen if n == 3 for h in o.heard)  # it has no edge from the leader


class LedByMotion(Bearings):
    """Hears the motion of a leader without commands, and sees nobody."""

    information = Information(message=Word, leaders=(1, 1))
    lead = Led.lead


@pytest.mark.parametrize("kind", ["virtual", "tracked"])
def test_a_leader_without_commands_sends_its_motion(kind: str, fly_law: Callable[..., Any]) -> None:
    circle = {"kind": "circle", "radius": 1.0, "rate": 0.3}
    changes = {"leader": {"kind": kind, "trajectory": circle}, "formation.rate": 0.0}
    changes |= (
        {"drones.0": None} if kind == "virtual" else {"drones.0": {"id": 0, "body": "wand", "start": [0.0, 0.0, 1.2]}}
    )
    fly_law(LedByMotion, changes, duration=7.0)
    heard = [h for n, o in LedByMotion.seen if n == 1 and o.place is not None and o.t > 1.0 for h in o.heard if h.leads]
    assert len(heard) > 50
    (x, y, _), velocity = heard[-1].content.place, heard[-1].content.parts
    angle = 0.3 * heard[-1].content.round / 1000
    assert abs(velocity[0][0]) == pytest.approx(0.3 * abs(np.cos(angle)), abs=0.03)
    assert 0.0 < hypot(x, y) < 3.0


def test_a_foreign_reader_reads_the_fields_of_the_laws_messages(
    make_swarm: Callable[..., Swarm], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setitem(sys.modules, "interface_law", sys.modules[__name__])
    Law.seen = []
    swarm = make_swarm({"control.law": "interface_law:Led"})
    path = tmp_path / "trace.mcap"
    fly_recorded(Flight(swarm, 0, 3.5), "", path, lambda _: None)
    with AnyReader([path], default_typestore=get_typestore(Stores.EMPTY)) as reader:
        topic = [one for one in reader.connections if one.topic.endswith("uav0/law")]
        contents = [reader.deserialize(raw, one.msgtype).contents for one, _, raw in reader.messages(topic)]
    last = next(one[-1] for one in reversed(contents) if len(one))
    assert len(last.place) == 3
    assert abs(last.parts_0) < 0.2  # m/s
    assert last.parts_1 == 2


def test_the_laws_own_check_is_asked(make_swarm: Callable[..., Swarm], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "interface_law", sys.modules[__name__])
    Law.seen = []
    swarm = make_swarm({"control.law": "interface_law:Led"})
    assert law_check(swarm) == (["the graph is too thin"], ["thin"], {"slowest": 0.25 * 5})
    monkeypatch.setattr(Led, "check", lambda *_: 1 / 0)
    assert "its check fails: ZeroDivisionError" in law_check(swarm)[0][0]
    monkeypatch.setattr(Led, "check", lambda *_: ("bad", [], {}))
    assert "it must return problems and notes (lists of text) and rates (a dict)" in law_check(swarm)[0][0]
