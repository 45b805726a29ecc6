"""An environment of PettingZoo: the followers of a swarm fly by actions from outside, in virtual time."""

from __future__ import annotations

from collections.abc import Callable
from math import dist
from pathlib import Path
from random import Random
from typing import Any, NamedTuple

import numpy as np
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import nanoseconds
from flockwire_core.domain.vector import ZERO, Vector, add
from flockwire_core.law import Decision, Observation, Output
from flockwire_core.loading import parse_swarm
from flockwire_core.swarm.model import uav
from flockwire_core.wire.information import declared
from flockwire_core.wire.observed_numbers import ObservedNumbers
from gymnasium.spaces import Box
from pettingzoo import ParallelEnv

from flockwire_lab.process import Published
from flockwire_lab.study.file import Starts, Study
from flockwire_lab.study.variation import swarm_table, vary
from flockwire_lab.trial import Trial
from flockwire_lab.world import World

ByName = dict[str, Any]


class State(NamedTuple):
    """The truth after a step: `t` s since time 0 of the formation; by id, positions, m, and places x_0 + h_i, m.

    Without a leader, or with several, there are no places. `commands` are the actions, `observations` the laws'.
    """

    t: float
    positions: dict[int, Vector]
    places: dict[int, Vector]
    commands: dict[int, Vector]
    observations: dict[int, Observation]

    def error(self, number: int) -> float:
        """Return the distance of a follower from its place, m."""
        return dist(self.positions[number], self.places[number])


Reward = Callable[[State, int], float]  # of the follower with that id


class Seat:
    """The law of one follower, whose command comes from outside: it flies at its next step."""

    def __init__(self) -> None:
        self.command: Vector = ZERO
        self.seen = Observation()

    def step(self, observation: Observation) -> Decision:
        """Keep the observation, return the command."""
        self.seen = observation
        return Decision(self.command)


class SwarmEnv(ParallelEnv):  # type: ignore[misc]
    """The swarm of `file`: an agent for each follower, whose observation is what the law in the file declares.

    An action is the command, three numbers, m/s or m/s^2. An episode begins at time 0 of the formation and is truncated
    after `duration` s; a step is a control period. `reward` is called for each follower after each step. With `box`, m,
    drones start anywhere in it, as in a study. The safety filter acts as in every flight. Raises SwarmFileError, and
    ValueError for a law that sends messages; `reset` InputError for a box without room.
    """

    metadata = {"name": "flockwire", "render_modes": []}  # noqa: RUF012  (PettingZoo's)
    render_mode = None  # that vectorisers ask for

    def __init__(
        self, file: str | Path, reward: Reward, duration: float = 10.0, box: tuple[float, float] | None = None
    ) -> None:
        self._table = swarm_table(Path(file))
        self._swarm = swarm = parse_swarm(self._table, str(file))
        information = declared(swarm)
        if information.message is not None:
            raise ValueError(f"{file}: control.law sends messages: an action is a command alone")
        self._reward, self._duration, self._seed = reward, duration, 0
        self._varied = Study(starts=None if box is None else Starts(box=box))
        self._period = nanoseconds(1.0 / swarm.control.rate_hz)
        self._numbers = {i: ObservedNumbers(information, swarm.topology.neighbours(i)) for i in swarm.followers}
        self._ids = {uav(i): i for i in swarm.followers}
        self.possible_agents = list(self._ids)
        self.agents: list[str] = []
        most = swarm.limits.acceleration if information.output is Output.ACCELERATION else None
        bounds = {i: swarm.full_speed(i) if most is None else most for i in swarm.followers}
        self._observed = {
            uav(i): Box(-np.inf, np.inf, (len(each.names),), np.float64) for i, each in self._numbers.items()
        }
        self._acts = {uav(i): Box(-bound, bound, (3,), np.float64) for i, bound in bounds.items()}

    def observation_space(self, agent: str) -> Box:
        """Return the space of the numbers that `ObservedNumbers` names."""
        return self._observed[agent]

    def action_space(self, agent: str) -> Box:
        """Return the space of commands, as large as the limit of each axis."""
        return self._acts[agent]

    def names(self, agent: str) -> tuple[str, ...]:
        """Return the name of each number of an observation."""
        return self._numbers[self._ids[agent]].names

    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[ByName, ByName]:
        """Take off and begin an episode; without a `seed` by the one after the last episode's."""
        self._seed = self._seed + 1 if seed is None else seed
        starts = Random(f"starts {self._seed}")  # noqa: S311  (not for secrets)
        swarm = vary(self._varied, self._table, (), self._seed, lambda _: starts).swarm
        self._seats, self._poses = {i: Seat() for i in swarm.followers}, dict[int, Vector]()
        self._owners = {uav(i): i for i in swarm.flying}
        world = World(swarm, self._seed, 0.0, tap=self._take, law=lambda _, i: self._seats[i])
        self._trial = Trial(world)
        self._trial.forward(until=0.0)
        self.agents = list(self.possible_agents)
        world.advance(world.scheduler.now + self._period)
        return self._observations(), {name: {} for name in self.agents}

    def step(self, actions: ByName) -> tuple[ByName, ...]:
        """Fly for one control period; all are terminated if the flight fails."""
        for name, action in actions.items():
            x, y, z = map(float, action)
            self._seats[self._ids[name]].command = (x, y, z)
        world = self._trial.world
        world.advance(world.scheduler.now + self._period)
        state, names = self.state_now, self.agents
        ended, over = bool(self._trial.failure), state.t >= self._duration
        rewards = {name: float(self._reward(state, self._ids[name])) for name in names}
        result: tuple[ByName, ...] = (
            self._observations(), rewards, dict.fromkeys(names, ended), dict.fromkeys(names, over),
            {name: {} for name in names},
        )  # fmt: skip
        if ended or over:
            self.agents = []
        return result

    def _observations(self) -> ByName:
        return {name: np.array(self._numbers[i].of(self._seats[i].seen)) for name, i in self._ids.items()}

    @property
    def state_now(self) -> State:
        """The truth after the last step."""
        leader, places = self._swarm.sole_leader, {}
        for i, seat in self._seats.items():
            place = seat.seen.place
            if leader is not None and place is not None:
                places[i] = add(self._poses[leader], place.offset(self._trial.t))
        commands = {i: seat.command for i, seat in self._seats.items()}
        observations = {i: seat.seen for i, seat in self._seats.items()}
        return State(self._trial.t, dict(self._poses), places, commands, observations)

    def _take(self, published: Published) -> None:
        """Keep the truth."""
        if published.key.kind == "truth" and isinstance(pose := published.message, Pose):
            self._poses[self._owners[published.key.owner]] = pose.position
