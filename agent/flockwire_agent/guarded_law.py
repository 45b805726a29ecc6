"""Guards a law that may raise: it reports the error with file and line, and waits for the next order."""

from __future__ import annotations

import logging
import traceback
from collections.abc import Callable
from concurrent.futures import Future
from functools import partial
from typing import Any

from flockwire_core.domain.time import nanoseconds
from flockwire_core.domain.vector import ZERO
from flockwire_core.follower_law import LateAnswerError, raised
from flockwire_core.law import RELAYING, Decision, Information, Law, Observation, check_decision
from flockwire_core.objects import FAILURES
from flockwire_core.process.cores import Aside, Stopwatch, at_once
from flockwire_core.wire.law_form import LawForm, packed
from flockwire_core.wire.status import LAW_FAILED, Reason

_shown: set[str] = set()  # failures of this process whose traceback was logged: the drones of `sim` share their law


class Planning:
    """Runs `plan` by `aside`; a result counts exactly `deadline` s after its observation, a late one as it comes.

    Until then `newest` is the last one, None before the first. `late` counts the late ones.
    """

    def __init__(self, plan: Callable[[Observation], Any], deadline: float, aside: Aside) -> None:
        self.newest: Any = None
        self.late = 0
        self._plan, self._deadline, self._aside = plan, nanoseconds(deadline), aside
        self._task: Future[object] | None = None
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


class GuardedLaw:
    """Calls `make` for the law of the drone `name`; raises its errors. The `stopwatch` measures its steps.

    It declares the information `declared`, and messages of the form `form`; `aside` computes its plans.
    """

    def __init__(
        self,
        make: Callable[[], Law],
        name: str,
        stopwatch: Stopwatch | None = None,
        declared: Information = RELAYING,
        form: LawForm | None = None,
        aside: Aside = at_once,
    ) -> None:
        self._make, self._name, self._stopwatch = make, name, stopwatch
        self._declared, self._form, self._aside = declared, form, aside
        self._law: Any = make()  # whose decision `check_decision` judges
        self._planning = self._make_planning()
        self.command = ZERO  # of the last decision
        self.message: bytes | None = None  # of the last decision, of the form
        self.late = 0  # plans, in all
        self.is_late = False  # whether the last step had no decision in time
        self.steps_late = 0  # such steps, in all
        self.failure: Reason | None = None  # the law's error, None without one

    def plan(self, now: int) -> Any:  # noqa: ANN401
        """Return the plan that counts at `now` (Unix ns), None without one; a plan that raised fails the law."""
        planning = self._planning
        if planning is None or self.failure is not None:
            return None
        try:
            planning.update(now)
        except FAILURES as error:
            self._failed(error)
        self.late = planning.late
        return planning.newest

    def step(self, observation: Observation) -> Decision | None:
        """Return the law's decision; None if it failed."""
        self.message = None
        if self.failure is not None:
            return None
        stopwatch = self._stopwatch
        try:
            if stopwatch is not None:
                stopwatch.begin()
            given = self._law.step(observation)
            if stopwatch is not None:
                stopwatch.end()
            self.command = check_decision(given)
            decision: Decision = given
            self.message = packed(decision.message, self._declared, self._form)
            if self._planning is not None:
                self._planning.begin(observation)
        except LateAnswerError:
            self.is_late, self.command = True, ZERO
            self.steps_late += 1
            return None
        except FAILURES as error:
            self._failed(error)
            return None
        self.is_late = False
        return decision

    def restart(self) -> None:
        """Make the law again, if it failed."""
        if self.failure is None:
            return
        try:
            self._law, self.failure = self._make(), None
            self._planning = self._make_planning()
        except FAILURES as error:
            self._failed(error)

    def _make_planning(self) -> Planning | None:
        plan, deadline = getattr(self._law, "plan", None), self._declared.deadline
        return Planning(plan, deadline, self._aside) if plan is not None and deadline > 0.0 else None

    def _failed(self, error: BaseException) -> None:
        line = f"the law failed: {raised(error)}"
        self.failure = Reason(LAW_FAILED, line)
        text = "".join(traceback.format_exception(error)) if line not in _shown else ""
        _shown.add(line)
        logging.getLogger(self._name).error("%s", f"{line}\n{text}".rstrip())
