"""Guards a law that may raise: it reports the error with file and line, and waits for the next order."""

from __future__ import annotations

import logging
import traceback
from collections.abc import Callable
from typing import Any

from flockwire_core.domain.vector import ZERO
from flockwire_core.law import RELAYING, Decision, Information, Law, Observation, check_decision
from flockwire_core.process.cores import Aside, Done
from flockwire_core.process.stopwatch import Stopwatch
from flockwire_core.wire.law_form import LawForm, packed
from flockwire_core.wire.status import LAW_FAILED, Reason

from flockwire_agent.planning import Planning

OURS = ("flockwire_agent/guarded_law.py", "flockwire_core/law.py", "flockwire_core/follower_law.py")  # not the law's
MOST_FRAMES = 4  # of the reported line


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
        aside: Aside = Done,
    ) -> None:
        self._make, self._name, self._stopwatch = make, name, stopwatch
        self._declared, self._form, self._aside = declared, form, aside
        self._law = make()
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
        except Exception as error:
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
            decision = self._law.step(observation)
            if stopwatch is not None:
                stopwatch.end()
            self.command = check_decision(decision)
            self.message = packed(decision.message, self._declared, self._form)
            if self._planning is not None:
                self._planning.begin(observation)
        except TimeoutError:  # of a law that asks another process
            self.is_late, self.command = True, ZERO
            self.steps_late += 1
            return None
        except Exception as error:
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
        except Exception as error:
            self._failed(error)

    def _make_planning(self) -> Planning | None:
        plan, deadline = getattr(self._law, "plan", None), self._declared.deadline
        return Planning(plan, deadline, self._aside) if plan is not None and deadline > 0.0 else None

    def _failed(self, error: Exception) -> None:
        line = f"the law failed: {type(error).__name__}: {error}{where(error)}"
        self.failure = Reason(LAW_FAILED, line)
        text = "".join(traceback.format_exception(error))
        logging.getLogger(self._name).error("%s", f"{line}\n{text.rstrip()}")


def where(error: Exception) -> str:
    """Return the file positions of `error`, the law's first, in one line."""
    frames = [f for f in traceback.extract_tb(error.__traceback__) if not f.filename.endswith(OURS)]
    places = [f"{frame.filename.rsplit('/', maxsplit=1)[-1]}:{frame.lineno}" for frame in frames[-MOST_FRAMES:]]
    return f" ({' > '.join(places)})" if places else ""
