"""An observation as numbers in a fixed order: for a law in another process, and for one that is learned."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from typing import TypeVar

from flockwire_core.domain.body import Body
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import ZERO, norm
from flockwire_core.law import Information, Observation, Seen, Sense
from flockwire_core.wire.law_form import LawForm, law_form

T = TypeVar("T")
Part = tuple[Sequence[str], Callable[[Observation], Iterable[float]]]  # names, and the numbers of an observation
NAMES = {Sense.BEARING: "bearing", Sense.DISTANCE: "distance", Sense.POSITION: "position", Sense.VELOCITY: "velocity"}
NEAREST = 8  # drones around, and bodies: a policy has as many inputs in every swarm


class ObservedNumbers:
    """The observation of a law that declares `information`, as numbers: no more than it declares.

    `neighbours` are its drone's in-neighbours. What is not there now (a pose, a neighbour, a place outside the
    formation) is zeros, with a 0 before it; m, m/s, s, world axes. Of drones around, and of bodies, it has the NEAREST.
    `names` has the name of each number.
    """

    def __init__(self, information: Information, neighbours: Iterable[int]) -> None:
        self.neighbours = tuple(sorted(neighbours))
        self._parts = tuple(_parts(information, self.neighbours))
        self.names = tuple(name for names, _ in self._parts for name in names)

    def of(self, observation: Observation) -> list[float]:
        """Return the numbers of an observation, as many as `names`."""
        found: list[float] = []
        for _, numbers in self._parts:
            found += numbers(observation)
        return found


def _parts(told: Information, neighbours: Sequence[int]) -> Iterator[Part]:
    form = law_form(told)
    yield ("in formation", "t", "dt"), _times
    yield (*_three("h"), *_three("h'")), _place
    if told.own:
        yield ("known", *_of_senses(told.own, "own ")), partial(_own, told.own)
    for j in neighbours:
        yield from _parts_of(j, told, form)
    if told.around:
        if told.radius > 0.0:
            yield [name for k in range(NEAREST) for name in _around_names(told, k)], partial(_around, told)
        yield [name for k in range(NEAREST) for name in _body_names(k)], _bodies


def _parts_of(j: int, told: Information, form: LawForm | None) -> Iterator[Part]:
    yield _three(f"h - h of {j}"), partial(_apart, j)
    if told.neighbours:
        yield (f"sees {j}", *_of_senses(told.neighbours, f"{j}: ")), partial(_neighbour, told.neighbours, j)
    if form is not None:
        content = [f"{j}: message {k}" for k in range(form.count)]
        yield (f"heard {j}", f"{j}: age", *content), partial(_heard, form, j)


def _three(name: str) -> tuple[str, str, str]:
    return f"{name} x", f"{name} y", f"{name} z"


def _of_senses(senses: Sense, before: str) -> Iterator[str]:
    for sense, name in NAMES.items():
        if senses & sense:
            yield from (before + name,) if sense is Sense.DISTANCE else _three(before + name)


def _around_names(told: Information, k: int) -> Iterator[str]:
    yield from (f"sees around {k}", *_of_senses(told.around, f"around {k}: "))
    if told.named:
        yield f"around {k}: number"


def _body_names(k: int) -> Iterator[str]:
    yield from (f"body {k}", f"body {k}: kind", *_three(f"body {k}: position"), f"body {k}: radius")


def _times(observation: Observation) -> Iterable[float]:
    return (float(observation.place is not None), observation.t, observation.dt)


def _place(observation: Observation) -> Iterable[float]:
    place, t = observation.place, observation.t
    return (*ZERO, *ZERO) if place is None else (*place.offset(t), *place.rate(t))


def _own(senses: Sense, observation: Observation) -> Iterator[float]:
    yield float(observation.position is not None or observation.velocity is not None)
    if senses & Sense.POSITION:
        yield from observation.position or ZERO
    if senses & Sense.VELOCITY:
        yield from observation.velocity or ZERO


def _apart(j: int, observation: Observation) -> Iterable[float]:
    return ZERO if observation.place is None else observation.place.to(j, observation.t)


def _neighbour(senses: Sense, j: int, observation: Observation) -> Iterator[float]:
    return _seen(senses, next((one for one in observation.neighbours if one.number == j), None))


def _seen(senses: Sense, one: Seen | None) -> Iterator[float]:
    yield float(one is not None)
    for sense, name in NAMES.items():
        if senses & sense:
            value = None if one is None else getattr(one, name)
            if sense is Sense.DISTANCE:
                yield value or 0.0
            else:
                yield from value or ZERO


def _heard(form: LawForm, j: int, observation: Observation) -> Iterator[float]:
    one = next((one for one in observation.heard if one.number == j), None)
    yield from (0.0, 0.0) if one is None else (float(one.sequence), (observation.now - one.stamp) / SECOND)
    yield from (0.0,) * form.count if one is None else form.flat(one.content)


def _around(told: Information, observation: Observation) -> Iterator[float]:
    for one in _nearest(observation.around, _distance):
        yield from _seen(told.around, one)
        if told.named:
            yield -1.0 if one is None else float(one.number)


def _bodies(observation: Observation) -> Iterator[float]:
    for body in _nearest(observation.bodies, _gap):
        found = (0.0, 0.0, *ZERO, 0.0)
        yield from found if body is None else (1.0, float(body.kind), *body.relative_position, body.radius)


def _nearest(found: Sequence[T], distance: Callable[[T], float]) -> Iterator[T | None]:
    yield from sorted(found, key=distance)[:NEAREST]
    yield from (None,) * (NEAREST - len(found))


def _distance(one: Seen) -> float:
    """Return the distance of a seen drone, m; 0 if it is not sensed."""
    return one.distance or (norm(one.position) if one.position is not None else 0.0)


def _gap(body: Body) -> float:
    return norm(body.relative_position) - body.radius
