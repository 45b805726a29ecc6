"""Laws in a pure world: ideal bodies, or with a lag; what a law declares is all that it observes."""

from dataclasses import dataclass, field
from functools import cache
from math import dist, exp, hypot, inf

import numpy as np
from flockwire_core.control.fence import Room
from flockwire_core.control.guard import GuardParameters
from flockwire_core.control.key_frames import KeyFrames
from flockwire_core.domain.body import Body, BodyKind, Separation
from flockwire_core.law import SECOND, Heard, LawSettings, LeaderMotion, Observation, Output, Place, Seen, Sense

ROOM = Room((-99.0, -99.0, -99.0), (99.0, 99.0, 99.0))
START = 1_790_000_000 * SECOND


def settings(number=1, dt=0.01, lag=0.0, **parameters):
    """Return the settings of a law, without those of the built-in ones."""
    others = dict.fromkeys(LawSettings._fields)
    guard = GuardParameters(Separation(0.4, 0.3), ROOM, 0.0, 9.0, 9.0, 9.0, 5.0, lag, dt, inf, 0.2)
    own = {
        "guard": guard,
        "number": number,
        "period": dt,
        "lag": lag,
        "dead_time": 0.0,
        "speed": 9.0,
        "acceleration": 9.0,
    }
    return LawSettings(**{**others, **own, "parameters": parameters})


def place(places, number, neighbours=()):
    """Return the place of `number`, of static `places` by number; only who has one is in the formation."""
    numbers = sorted(places)
    formation = KeyFrames(((0.0,),) * len(numbers), tuple((tuple(map(float, places[j])),) for j in numbers))
    return Place(formation, numbers.index(number), START, {j: numbers.index(j) for j in neighbours if j in places})


@cache
def shown(sense):
    """Return whether `sense` shows bearing, distance, position and velocity."""
    return tuple(bool(sense & one) for one in (Sense.BEARING, Sense.DISTANCE, Sense.POSITION, Sense.VELOCITY))


def sight(sense, number, weight, leads, position, velocity):
    """Return what is sensed of a drone with the relative `position` and `velocity`."""
    bearing, distance_, position_, velocity_ = shown(sense)
    x, y, z = position = tuple(map(float, position))
    distance = hypot(x, y, z)
    return Seen(
        number, weight, leads,
        (x / distance, y / distance, z / distance) if bearing else None,
        distance if distance_ else None,
        position if position_ else None,
        tuple(map(float, velocity)) if velocity_ else None,
    )  # fmt: skip


@dataclass
class Flight:
    """Followers `law` at `positions` by number, `edges` (source, target, weight); leaders: t -> (p, v, a) by number."""

    law: type
    positions: dict
    edges: list
    places: dict = field(default_factory=dict)
    leaders: dict = field(default_factory=dict)
    parameters: dict = field(default_factory=dict)
    velocities: dict = field(default_factory=dict)
    dt: float = 0.01
    lag: float = 0.0

    def __post_init__(self):
        self.t, self.k, self.messages = 0.0, 0, 0
        self.p = {i: np.array(x, float) for i, x in self.positions.items()}
        self.v = {i: np.array(self.velocities.get(i, np.zeros(3)), float) for i in self.p}
        self.w = {i: v.copy() for i, v in self.v.items()}  # summed accelerations
        self.places = self.places or dict.fromkeys(self.p, np.zeros(3))
        self.laws = {i: self.law(settings(i, self.dt, self.lag, **self.parameters)) for i in self.p}
        self.inward = {i: {j: w for j, target, w in self.edges if target == i} for i in self.p}
        self.sites = {i: place(self.places, i, self.inward[i]) for i in self.p}
        self.heard = {i: {} for i in self.p}
        self.news = {i: [] for i in self.p}
        self.sequence = dict.fromkeys([*self.p, *self.leaders], 0)
        self.plans = dict.fromkeys(self.p, (0.0, None, None))  # counts from, next, current
        self.decisions = {}
        self._lead()

    @property
    def graph(self):
        """The graph, as a law's check takes it."""
        return Plain(tuple(self.p), tuple(self.edges))

    @property
    def array(self):
        """The positions, (n, 3)."""
        return np.array(list(self.p.values()))

    def observe(self, i, motion):
        """Return what drone i observes of the `motion` of all."""
        info, (p, v) = self.law.information, motion[i]

        def see(sense, j, weight):
            (a, b, c), (d, e, f) = motion[j]
            relative = (a - p[0], b - p[1], c - p[2]), (d - v[0], e - v[1], f - v[2])
            return sight(sense, j if weight else -1, weight, j in self.leaders, *relative)

        neighbours = [see(info.neighbours, j, w) for j, w in self.inward[i].items()] if info.neighbours else ()
        drones = [j for j in motion if j != i] if info.around else ()
        bodies = [Body(BodyKind.DRONE, tuple(np.subtract(motion[j][0], p).tolist()), 0.0, motion[j][1]) for j in drones]
        near = [j for j in self.p if j != i and dist(motion[j][0], p) < info.radius] if info.around else ()
        return Observation(
            t=self.t, dt=self.dt, stamp=self.now, now=self.now,
            position=p if shown(info.own)[2] else None, velocity=v if shown(info.own)[3] else None,
            neighbours=neighbours, around=[see(info.around, j, 0.0) for j in near], bodies=bodies,
            heard=list(self.heard[i].values()), news=self.news[i], place=self.sites[i], plan=self.plans[i][2],
        )  # fmt: skip

    @property
    def now(self):
        """Unix ns."""
        return START + round(self.t * SECOND)

    def step(self):
        """Make one step: all observe, decide, move; messages arrive before the next one."""
        motion = {j: (one.position, one.velocity) for j, one in self.led.items()}
        motion |= {i: (tuple(self.p[i].tolist()), tuple(self.v[i].tolist())) for i in self.p}
        observations = {i: self.observe(i, motion) for i in self.p}
        for i, observation in observations.items():
            self._plan(i, observation)
        self.decisions = {i: law.step(observations[i]) for i, law in self.laws.items()}
        self.news = {i: [] for i in self.p}
        for i, decision in self.decisions.items():
            self._move(i, np.array(decision.command, float))
            if decision.message is not None:
                self._send(i, decision.message, decision.stamp or self.now)
                self.messages += 1
        self.k += 1
        self.t = self.k * self.dt
        self._lead()

    def fly(self, duration, each=None):
        """Fly for `duration` s; return what `each(self)` gives before every step and at the end, as an array."""
        found = []
        for _ in range(round(duration / self.dt)):
            found += [] if each is None else [each(self)]
            self.step()
        return np.array(found if each is None else [*found, each(self)])

    def _move(self, i, u):
        share = 1.0 - exp(-self.dt / self.lag) if self.lag else 1.0
        if self.law.information.output is Output.ACCELERATION:
            command, self.w[i] = self.w[i] + u * self.dt / share, self.w[i] + u * self.dt
        else:
            command = u
        self.v[i] = self.v[i] + (command - self.v[i]) * share
        self.p[i] = self.p[i] + self.v[i] * self.dt

    def _send(self, j, content, stamp):
        self.sequence[j] += 1
        for i, weights in self.inward.items():
            if j in weights:
                one = Heard(j, weights[j], j in self.leaders, stamp, self.sequence[j], content)
                self.heard[i][j] = one
                self.news[i].append(one)

    def _lead(self):
        self.led = {j: LeaderMotion(*(tuple(map(float, x)) for x in path(self.t))) for j, path in self.leaders.items()}
        for j, motion in self.led.items():
            if self.law.information.message is LeaderMotion:  # its pose is its estimate
                self._send(j, LeaderMotion(motion.position), self.now)
            elif hasattr(self.law, "lead"):
                self._send(j, self.law.lead(self.t, motion), self.now)

    def _plan(self, i, observation):
        due, coming, current = self.plans[i]
        if not hasattr(self.law, "plan") or self.t < due - 1e-9:
            return
        current = coming if coming is not None else current
        coming = self.laws[i].plan(observation._replace(plan=current))
        self.plans[i] = (self.t + self.law.information.deadline, coming, current)


@dataclass(frozen=True)
class Plain:
    """A graph of any leaders and weights."""

    followers: tuple
    edges: tuple

    @property
    def leaders(self):
        """Whoever else is an end of an edge."""
        return tuple(sorted({j for j, _, _ in self.edges} - set(self.followers)))


def both(pairs, weight=1.0):
    """Return the edges of `pairs` in both directions."""
    return [edge for i, j in pairs for edge in ((i, j, weight), (j, i, weight))]


def graph(followers, edges):
    """Return a graph with edges of weights."""
    return Plain(tuple(followers), tuple(edges))


def at(point):
    """Return the path of a leader at rest."""
    return lambda t: (point, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


def rate(errors, dt, from_, to):
    """Return the rate, 1/s, at which `errors` fall between two times."""
    a, b = round(from_ / dt), round(to / dt)
    return float(np.log(errors[a] / errors[b]) / (to - from_))


__all__ = ["Flight", "at", "both", "graph", "place", "rate", "settings", "sight"]
