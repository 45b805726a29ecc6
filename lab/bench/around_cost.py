"""What the ways round cost of an agent's step: one flight of twelve drones between two obstacles, as a table.

    python lab/bench/around_cost.py [--seconds 10]

In each step the followers' way round is computed twice from the same observation: by the law, and by the sidestep
alone, as the law was before it bent places and turned corrections. The flight is the law's. Times are processor times
of the thread, means over all followers' steps with bodies nearby, and the ratio is that of whole steps.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path
from time import thread_time_ns

from around_cases import merged
from flockwire_agent.core import AgentCore
from flockwire_agent.extended_law import SIDE_SWITCH_TIME, ExtendedLaw
from flockwire_core.control.around.sidestep import Sidestep
from flockwire_core.domain.motion import Motion
from flockwire_core.domain.vector import Vector, add, limit, norm, scale
from flockwire_core.law import LawSettings, Observation
from flockwire_core.loading import load_table, parse_swarm
from flockwire_core.wire.codec import Message
from flockwire_core.wire.keys import Key
from flockwire_lab.world import World

SWARM = Path(__file__).parent / "separation" / "twelve.toml"


@dataclass
class Cost:
    """Sums of processor times, ns, over `steps` steps; `here` is what this step's two ways round took."""

    steps: int = 0
    whole: int = 0
    now: int = 0
    before: int = 0
    here: tuple[int, int] = (0, 0)


COST = Cost()


class Timed(ExtendedLaw):
    """The extended law, which times its way round and the sidestep alone."""

    def __init__(self, settings: LawSettings) -> None:
        super().__init__(settings)
        self._alone = Sidestep(settings.sidestep, SIDE_SWITCH_TIME)

    def _around(self, observation: Observation, motion: Motion, forward: Vector, error: Vector, now: float) -> Vector:
        start = thread_time_ns()
        wanted = super()._around(observation, motion, forward, error, now)
        middle = thread_time_ns()
        correction = limit(scale(error, -self._gain), self._speed)
        add(forward, self._alone.turned(correction, observation.bodies, norm(error), now))
        COST.here = (middle - start, thread_time_ns() - middle) if observation.bodies else (0, 0)
        return wanted


def timed_step(core: AgentCore, now: int) -> list[tuple[Key, Message]]:
    """Take a step and add up what it took."""
    COST.here, start = (0, 0), thread_time_ns()
    sent = STEP(core, now)
    took, (new, old) = thread_time_ns() - start, COST.here
    if new:
        COST.steps, COST.whole = COST.steps + 1, COST.whole + took - old
        COST.now, COST.before = COST.now + new, COST.before + old
    return sent


STEP = AgentCore.step


def main() -> None:
    """Fly and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=10.0)
    seconds = parser.parse_args().seconds
    AgentCore.step = timed_step  # type: ignore[method-assign]
    swarm = parse_swarm(merged(load_table(SWARM), {"control": {"law": "__main__:Timed"}}), str(SWARM))
    World(swarm, 1, seconds).run()
    whole, now, before = (value / COST.steps / 1000.0 for value in (COST.whole, COST.now, COST.before))
    print(f"steps with bodies nearby {COST.steps}; a step {whole:.1f} us, of it the way round {now:.1f} us;")
    alone = whole - now + before
    print(f"with the sidestep alone {alone:.1f} us, {before:.1f} us: {whole / alone:.3f} x")


if __name__ == "__main__":
    main()
