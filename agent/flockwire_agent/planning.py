"""Runs the `plan` of a law beside its steps: one at a time, each counts from its observation + deadline on."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from flockwire_core.domain.time import nanoseconds
from flockwire_core.law import Observation
from flockwire_core.process.cores import Aside, Task


class Planning:
    """Runs `plan` by `aside`; a result counts exactly `deadline` s after its observation, a late one as it comes.

    Until then `newest` is the last one, None before the first. `late` counts the late ones.
    """

    def __init__(self, plan: Callable[[Observation], Any], deadline: float, aside: Aside) -> None:
        self.newest: Any = None
        self.late = 0
        self._plan, self._deadline, self._aside = plan, nanoseconds(deadline), aside
        self._task: Task | None = None
        self._due = 0
        self._waits = False

    def update(self, now: int) -> None:
        """Take a result that counts at `now` (Unix ns); raises what the plan raised."""
        if self._task is None or now < self._due:
            return
        if not self._task.done():
            self.late += not self._waits
            self._waits = True
            return
        task, self._task, self._waits = self._task, None, False
        self.newest = task.result()

    def begin(self, observation: Observation) -> None:
        """Begin a plan in the formation phase, if none is under way; outside it none counts."""
        if observation.place is None:
            self.newest = None
        elif self._task is None:
            self._due = observation.now + self._deadline
            self._task = self._aside(partial(self._plan, observation))
