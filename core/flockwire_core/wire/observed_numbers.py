"""An observation as numbers in a fixed order: for a law in another process, and for one that is learned."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import TypeVar

from flockwire_core.domain.body import Body
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import ZERO, norm
from flockwire_core.law import Heard, Information, Observation, Seen, Sense
from flockwire_core.wire.law_form import law_form

T = TypeVar("T")
One = TypeVar("One", Seen, Heard)
Part = tuple[str, Sequence[str], Iterable[float]]  # its name, what each number's name adds to it, and the numbers
NAMES = {Sense.BEARING: "bearing", Sense.DISTANCE: "distance", Sense.POSITION: "position", Sense.VELOCITY: "velocity"}
ITSELF, AXES = ("",), (" x", " y", " z")  # the additions of one number, and of a vector
BODY = ("", ": kind", ": position x", ": position y", ": position z", ": radius")
NO_BODY = (0.0, 0.0, *ZERO, 0.0)
NEAREST = 8  # drones around, and bodies: a policy has as many inputs in every swarm


class ObservedNumbers:
    """The observation of a law that declares `information`, as numbers: no more than it declares.

    `neighbours` are its drone's in-neighbours. What is not there now (a pose, a neighbour, a place outside the
    formation) is zeros, with a 0 before it; m, m/s, s, world axes. Of drones around, and of bodies, it has the NEAREST.
    `names` has the name of each number.
    """

    def __init__(self, information: Information, neighbours: Iterable[int]) -> None:
        self.neighbours = tuple(sorted(neighbours))
        self._told, self._form = information, law_form(information)
        self.names = tuple(
            name + addition for name, additions, _ in self._parts(Observation()) for addition in additions
        )

    def of(self, observation: Observation) -> list[float]:
        """Return the numbers of an observation, as many as `names`."""
        return [number for _, _, numbers in self._parts(observation) for number in numbers]

    def _parts(self, observation: Observation) -> Iterator[Part]:
        told, place, t = self._told, observation.place, observation.t
        offset, rate = (ZERO, ZERO) if place is None else (place.offset(t), place.rate(t))
        yield "", ("in formation", "t", "dt"), (float(place is not None), t, observation.dt)
        yield "h", AXES, offset
        yield "h'", AXES, rate
        if told.own:
            yield "known", ITSELF, (float(observation.position is not None or observation.velocity is not None),)
            yield from _sensed("own ", told.own, observation)
        for j in self.neighbours:
            yield f"h - h of {j}", AXES, ZERO if place is None else place.to(j, t)
            yield from self._neighbour(j, observation)
        if told.around and told.radius > 0.0:
            yield from _around(told, observation)
        if told.around:
            yield from _bodies(observation)

    def _neighbour(self, j: int, observation: Observation) -> Iterator[Part]:
        """Yield what is seen of in-neighbour `j`, and heard from it."""
        senses, form = self._told.neighbours, self._form
        if senses:
            yield from _seen(f"sees {j}", f"{j}: ", senses, _of(j, observation.neighbours))
        if form is not None:
            one = _of(j, observation.heard)
            numbers = (0.0, 0.0) if one is None else (float(one.sequence), (observation.now - one.stamp) / SECOND)
            yield "", (f"heard {j}", f"{j}: age"), numbers
            content = (0.0,) * form.count if one is None else form.flat(one.content)
            yield f"{j}: message ", [str(k) for k in range(form.count)], content


def _of(j: int, found: Iterable[One]) -> One | None:
    return next((one for one in found if one.number == j), None)


def _around(told: Information, observation: Observation) -> Iterator[Part]:
    nearest = _nearest(observation.around, _distance)
    for k, one in enumerate(nearest):
        yield from _seen(f"sees around {k}", f"around {k}: ", told.around, one)
        if told.named:
            yield f"around {k}: number", ITSELF, (-1.0 if one is None else float(one.number),)


def _bodies(observation: Observation) -> Iterator[Part]:
    nearest = _nearest(observation.bodies, _gap)
    for k, body in enumerate(nearest):
        one = NO_BODY if body is None else (1.0, float(body.kind), *body.relative_position, body.radius)
        yield f"body {k}", BODY, one


def _seen(whether: str, before: str, senses: Sense, one: Seen | None) -> Iterator[Part]:
    yield whether, ITSELF, (float(one is not None),)
    yield from _sensed(before, senses, one)


def _sensed(before: str, senses: Sense, one: Observation | Seen | None) -> Iterator[Part]:
    for sense, name in NAMES.items():
        if senses & sense:
            value = getattr(one, name, None)
            if sense is Sense.DISTANCE:
                yield before + name, ITSELF, (value or 0.0,)
            else:
                yield before + name, AXES, value or ZERO


def _nearest(found: Sequence[T], distance: Callable[[T], float]) -> list[T | None]:
    return [*sorted(found, key=distance)[:NEAREST], *[None] * (NEAREST - len(found))]


def _distance(one: Seen) -> float:
    """Return the distance of a seen drone, m; 0 if it is not sensed."""
    return one.distance or (norm(one.position) if one.position is not None else 0.0)


def _gap(body: Body) -> float:
    return norm(body.relative_position) - body.radius
