"""Receives from a tracker for some seconds, without the swarm: rate, jitter, latency, loss and motion of each body."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from math import dist, hypot
from random import Random
from statistics import fmean, median, pstdev
from typing import NamedTuple, get_args

from flockwire_core import clock
from flockwire_core.domain.pose import LEVEL
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import Vector
from flockwire_core.process.cores import Start
from flockwire_core.swarm.gateway import Unit, UpAxis
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.processes import GATEWAY

from flockwire_mocap.coordinates import Coordinates, coordinates_of
from flockwire_mocap.core import make_core
from flockwire_mocap.process import feed
from flockwire_mocap.tracking import NO_FRAMES, ReportedBody, SourceState, TrackerFrame, owner

BETTER = 0.2  # times the present distance from the starts, and
NEAR = 3.0  # times the tolerance: how near other settings must bring every drone to be suggested
OTHER = (
    "a drone is {far:.2f} m from its start; with unit = {unit!r} and up_axis = {up_axis!r} in [gateway.{source}] "
    "all would be within {near:.2f} m of theirs"
)


class BodyFigures(NamedTuple):
    """The measured figures of one body.

    Attributes:
        name: the tracker's, or its number as text if it has none.
        drone: the body's drone, None for other bodies.
        rate: of frames with the body tracked, Hz.
        jitter: standard deviation of the time between two, s.
        latency: from capture to arrival, s, median; the smallest delay of the network counts as none.
        lost: share of frames in which it was not tracked.
        position: average, m; None if it was never tracked.
        motion: standard deviation of its position, m.

    """

    name: str
    drone: int | None
    rate: float
    jitter: float
    latency: float
    lost: float
    position: Vector | None
    motion: float


class _Body:
    def __init__(self) -> None:
        self.arrivals, self.latencies, self.places = list[int](), list[int](), list[Vector]()
        self.lost = 0


class Inspection:
    """Collects frames of a source of `swarm`, on the field and in local time."""

    def __init__(self, swarm: Swarm) -> None:
        self._swarm, self._drones = swarm, {swarm.body(i): i for i in swarm.tracked}
        self._bodies: dict[tuple[int, str | None], _Body] = {}

    def take(self, frame: TrackerFrame, now: int) -> None:
        """Receive a frame that arrived at `now` (Unix ns)."""
        for body in frame.bodies:
            found = self._bodies.setdefault((body.identity, body.name), _Body())
            if body.tracked:
                found.arrivals.append(now)
                found.latencies.append(now - frame.captured)
                found.places.append(body.position)
            else:
                found.lost += 1

    def figures(self) -> list[BodyFigures]:
        """Return the figures, drones first."""
        rows = [self._row(identity, name, body) for (identity, name), body in self._bodies.items()]
        return sorted(rows, key=lambda row: (row.drone is None, row.drone or 0, row.name))

    def places(self) -> dict[str, Vector]:
        """Return where each body that was tracked was on average, by its name, m."""
        return {row.name: row.position for row in self.figures() if row.position is not None}

    def problems(self, trouble: str = "") -> list[str]:
        """Return the problems to correct before a flight, one line each; `trouble` is the source's.

        Every drone's body must be present, tracked, still, and at its start; one that a person carries may move.
        """
        rows = self.figures()
        if not rows:
            return [trouble or NO_FRAMES]
        there = {row.drone: row for row in rows if row.drone is not None}
        seen = _free_bodies(rows)
        lines = [trouble] if trouble else []
        for i in self._swarm.tracked:
            if i not in there:
                lines.append(f"{uav(i)}: the tracker has no body {self._swarm.body(i)!r}: define it there{seen}")
            else:
                lines += self._problem(there[i], self._swarm.drone(i).start)
        other = self._conventions(there)
        return [*lines, other] if other else lines

    def _conventions(self, there: dict[int, BodyFigures]) -> str:
        """Return which unit and up axis bring all flying drones near their starts; empty if all are near them now."""
        read, tolerance = coordinates_of(self._swarm.gateway), self._swarm.limits.start_tolerance
        points: list[tuple[Vector, Vector]] = []  # where each is seen, in the tracker's frame, and where it starts
        for i, row in there.items():
            if i in self._swarm.flying and row.position is not None:
                seen = ReportedBody(i, None, row.position, LEVEL, tracked=True)
                points.append((read.to_tracker(seen).position, self._swarm.drone(i).start))

        def farthest(frame: Coordinates) -> float:
            return max((dist(frame.position(point), start) for point, start in points), default=0.0)

        frames = [replace(read, unit=unit, up_axis=axis) for unit in get_args(Unit) for axis in get_args(UpAxis)]
        best = min(frames, key=farthest)
        far, near = farthest(read), farthest(best)
        if far <= tolerance or near > min(BETTER * far, NEAR * tolerance):
            return ""
        source = self._swarm.gateway.source
        return OTHER.format(far=far, near=near, unit=best.unit, up_axis=best.up_axis, source=source)

    def _problem(self, row: BodyFigures, start: Vector) -> list[str]:
        who = f"{uav(row.drone or 0)}: its body {row.name!r}"
        if row.position is None:
            return [f"{who} is not tracked: check its markers, and that cameras see it"]
        if row.drone not in self._swarm.flying:
            return []
        beside = dist(row.position, start)
        if row.motion > 0.02:  # m, standard deviation of the position of a body that stands still
            return [f"{who} moves by {row.motion:.2f} m: put it down, or it belongs to another drone"]
        if beside > self._swarm.limits.start_tolerance:
            x, y, z = row.position
            nearest = min(self._swarm.tracked, key=lambda i: dist(self._swarm.drone(i).start, row.position or start))
            other = f" (the start of {uav(nearest)})" if nearest != row.drone else ""
            return [f"{who} is at [{x:.2f}, {y:.2f}, {z:.2f}], {beside:.2f} m from its start{other}"]
        return []

    def _row(self, identity: int, name: str | None, body: _Body) -> BodyFigures:
        drone = owner(self._drones, identity, name)
        shown = name if name is not None else f"{identity}"
        seen = len(body.arrivals)
        lost = body.lost / (seen + body.lost)
        if seen < 2:
            return BodyFigures(shown, drone, 0.0, 0.0, 0.0, lost, body.places[0] if seen else None, 0.0)
        gaps = [(b - a) / SECOND for a, b in zip(body.arrivals, body.arrivals[1:], strict=False)]
        x, y, z = (fmean(axis) for axis in zip(*body.places, strict=True))
        motion = hypot(*(pstdev(axis) for axis in zip(*body.places, strict=True)))
        rate, latency = 1.0 / max(fmean(gaps), 1e-9), median(body.latencies) / SECOND
        return BodyFigures(shown, drone, rate, pstdev(gaps), latency, lost, (x, y, z), motion)


def _free_bodies(rows: list[BodyFigures]) -> str:
    """Return a clause with the names of the bodies that are no drone's, empty without one."""
    free = ", ".join(repr(row.name) for row in rows if row.drone is None)
    return f"; free bodies: {free}" if free else ""


async def listen(plan: Plan, seconds: float) -> tuple[Inspection, SourceState]:
    """Return the frames of `seconds`, and the state of the connection; raises OSError if the source cannot be opened.

    Raises ValueError for a source without its own connection.
    """
    core = make_core(Start(plan, GATEWAY.kind, clock.now(), Random(0)))  # noqa: S311
    source, inspection = core.source, Inspection(plan.swarm)
    begin = clock.monotonic() + round(1.2 * SECOND)  # s before the first frame counts: connections and names come first

    def drained() -> None:
        now = clock.now()
        for frame in source.take(now):
            if clock.monotonic() > begin:
                inspection.take(frame, now)

    connection = feed(core, drained)
    if connection is None:
        raise ValueError(f"gateway.source = {plan.swarm.gateway.source!r}: there is no tracker to listen to")
    async with connection:
        while clock.monotonic() < begin + round(seconds * SECOND):
            await asyncio.sleep(core.period)
            if not source.triggers:  # no message completes its frames: they are due by time
                drained()
        return inspection, source.state(clock.now())
