"""A swarm in virtual time that flies as far as it is asked."""

from __future__ import annotations

from pathlib import Path

from flockwire_analysis.recorded import Trace
from flockwire_analysis.tracking import formation_errors
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.ground.director import POLL_PERIOD, Stage
from flockwire_core.loading import load_swarm
from flockwire_core.swarm.model import uav

from flockwire_lab.flight import TraceInMemory
from flockwire_lab.world import World

STALE = SECOND  # ns, age of an error that is not the present one any more


class Trial:
    """The swarm of `world`, which takes off and flies its formation."""

    def __init__(self, world: World) -> None:
        self.world = world

    @property
    def t(self) -> float:
        """The s since time 0 of the formation; negative before it is known."""
        start = self.world.director.formation_start
        return -1.0 if start is None else (self.world.scheduler.now - start) / SECOND

    @property
    def failure(self) -> str:
        """Why the flight has ended; empty while it has not."""
        director = self.world.director
        return director.failure or ("it landed" if director.stage is Stage.OVER else "")

    def forward(self, until: float) -> None:
        """Fly on until `until` s after time 0 of the formation; raises AssertionError if the flight fails."""
        world = self.world
        while self.t < until:
            start = world.director.formation_start
            step = world.scheduler.now + nanoseconds(POLL_PERIOD)
            world.advance(step if start is None else start + nanoseconds(until))
            if self.failure:
                raise AssertionError(f"the flight failed at t = {self.t:.1f} s: {self.failure}")


class VirtualSwarm(Trial):
    """The swarm of `file`, which takes off and flies its formation by `seed`; equal seeds give equal flights.

    Raises SwarmFileError for a bad file.
    """

    def __init__(self, file: str | Path, seed: int = 0) -> None:
        swarm = load_swarm(Path(file)).in_simulation()
        self._recorded = TraceInMemory(swarm, seed)
        super().__init__(World(swarm, seed, 0.0, tap=self._recorded.take))

    def trace(self) -> Trace:
        """Return what was recorded so far, as `flockwire.analysis.read_trace` returns a flight's."""
        return self._recorded.trace()

    def errors(self) -> dict[int, float]:
        """Return the present formation error of each follower, m, by its number; inf of one that has none.

        Without a leader, or with several, it is what the law measures itself.
        """
        now = self.world.scheduler.now
        return {
            i: float(each.values[-1]) if len(each.stamps) and now - each.stamps[-1] < STALE else float("inf")
            for i, each in formation_errors(self.trace()).items()
        }

    def assert_in_formation(self, limit: float) -> None:
        """Raise AssertionError unless each follower is within `limit` m of its place."""
        off = [f"{uav(i)} {error:.4g} m" for i, error in self.errors().items() if not error <= limit]
        if off:
            raise AssertionError(f"more than {limit:g} m off their places at t = {self.t:.1f} s: {', '.join(off)}")
