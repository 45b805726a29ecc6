"""An observation as numbers in a fixed order: for a law in another process, and for one that is learned."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TypeVar

from flockwire_core.domain.body import Body
from flockwire_core.domain.vector import norm
from flockwire_core.law import Heard, Information, Observation, Seen, Sense
from flockwire_core.wire.law_form import law_form

NAMES = {Sense.BEARING: "bearing", Sense.DISTANCE: "distance", Sense.POSITION: "position", Sense.VELOCITY: "velocity"}
T = TypeVar("T")
NEAREST = 8  # drones around, and bodies: a policy has as many inputs in every swarm
SIZES = {"distance": 1}  # of what is no vector


class ObservedNumbers:
    """The observation of a law that declares `information`, as numbers: no more than it declares.

    `neighbours` are its drone's in-neighbours. What is not there now (a pose, a neighbour, a place outside the
    formation) is zeros, with a 0 before it; m, m/s, s, world axes. Of drones around, and of bodies, it has the NEAREST.
    `names` has the name of each number.
    """

    def __init__(self, information: Information, neighbours: Iterable[int]) -> None:
        self.information, self.neighbours = information, tuple(sorted(neighbours))
        self._form = law_form(information)
        self._around = NEAREST if information.around and information.radius > 0.0 else 0
        self._bodies = NEAREST if information.around else 0
        self.names = tuple(self._names())

    def of(self, observation: Observation) -> list[float]:
        """Return the numbers of an observation, as many as `names`."""
        place, t, declared = observation.place, observation.t, self.information
        found = [1.0 if place is not None else 0.0, t, observation.dt]
        for vector in (place.offset(t), place.rate(t)) if place is not None else (None, None):
            found += vector or (0.0, 0.0, 0.0)
        if declared.own:
            found.append(1.0 if observation.position is not None or observation.velocity is not None else 0.0)
            for sense, vector in ((Sense.POSITION, observation.position), (Sense.VELOCITY, observation.velocity)):
                if declared.own & sense:
                    found += vector or (0.0, 0.0, 0.0)
        seen = {one.number: one for one in observation.neighbours}
        heard = {one.number: one for one in observation.heard}
        for j in self.neighbours:
            found += place.to(j, t) if place is not None else (0.0, 0.0, 0.0)
            if declared.neighbours:
                found += self._seen(declared.neighbours, seen.get(j))
            if self._form is not None:
                found += self._heard(heard.get(j), observation.now)
        for slot in _slots(sorted(observation.around, key=_distance), self._around):
            found += self._seen(declared.around, slot)
            if declared.named:
                found.append(float(slot.number) if slot is not None else -1.0)
        for body in _slots(sorted(observation.bodies, key=_gap), self._bodies):
            found += _body(body)
        return found

    def _names(self) -> Iterator[str]:
        told = self.information
        yield from ("in formation", "t", "dt", *_three("h"), *_three("h'"))
        if told.own:
            yield "known"
            yield from _of_senses(told.own, "own ")
        for j in self.neighbours:
            yield from _three(f"h - h of {j}")
            if told.neighbours:
                yield from (f"sees {j}", *_of_senses(told.neighbours, f"{j}: "))
            if self._form is not None:
                yield from (f"heard {j}", f"{j}: age", *(f"{j}: message {k}" for k in range(self._form.count)))
        for k in range(self._around):
            yield from (f"sees around {k}", *_of_senses(told.around, f"around {k}: "))
            if told.named:
                yield f"around {k}: number"
        for k in range(self._bodies):
            yield from (f"body {k}", f"body {k}: kind", *_three(f"body {k}: position"), f"body {k}: radius")

    def _seen(self, senses: Sense, one: Seen | None) -> Iterator[float]:
        yield 1.0 if one is not None else 0.0
        for sense, name in NAMES.items():
            if senses & sense:
                value = None if one is None else getattr(one, name)
                if SIZES.get(name) == 1:
                    yield value or 0.0
                else:
                    yield from value or (0.0, 0.0, 0.0)

    def _heard(self, one: Heard | None, now: int) -> Iterator[float]:
        assert self._form is not None  # noqa: S101  (the law has messages)
        yield float(one.sequence) if one is not None else 0.0
        yield (now - one.stamp) / 1e9 if one is not None else 0.0
        yield from self._form.flat(one.content) if one is not None else (0.0,) * self._form.count


def _three(name: str) -> tuple[str, str, str]:
    return f"{name} x", f"{name} y", f"{name} z"


def _of_senses(senses: Sense, before: str) -> Iterator[str]:
    for sense, name in NAMES.items():
        if senses & sense:
            yield from (before + name,) if SIZES.get(name) == 1 else _three(before + name)


def _slots(found: Sequence[T], count: int) -> Iterator[T | None]:
    yield from found[:count]
    yield from (None,) * (count - len(found))


def _distance(one: Seen) -> float:
    """Return the distance of a seen drone, m; 0 if it is not sensed."""
    return one.distance or (norm(one.position) if one.position is not None else 0.0)


def _gap(body: Body) -> float:
    return norm(body.relative_position) - body.radius


def _body(body: Body | None) -> tuple[float, ...]:
    if body is None:
        return (0.0,) * 6
    return (1.0, float(body.kind), *body.relative_position, body.radius)
