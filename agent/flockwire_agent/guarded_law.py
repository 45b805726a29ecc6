"""Guards a law that may raise: it reports the error with file and line, and waits for the next order."""

from __future__ import annotations

import logging
import traceback
from collections.abc import Callable

from flockwire_core.domain.vector import ZERO
from flockwire_core.law import Decision, Law, Observation, check_decision
from flockwire_core.process.stopwatch import Stopwatch
from flockwire_core.wire.status import LAW_FAILED, Reason

OWN = "flockwire_agent"  # this file's frames are not the law's
MOST_FRAMES = 4  # characters of the reported line


class GuardedLaw:
    """Calls `make` for the law of the drone `name`; raises its errors. The `stopwatch` measures its steps."""

    def __init__(self, make: Callable[[], Law], name: str, stopwatch: Stopwatch | None = None) -> None:
        self._make, self._name, self._stopwatch = make, name, stopwatch
        self._law = make()
        self.command = ZERO  # of the last decision
        self.failure: Reason | None = None  # the law's error, None without one

    def step(self, observation: Observation) -> Decision | None:
        """Return the law's decision; None if it failed."""
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
        except Exception as error:
            self._failed(error)
            return None
        return decision

    def restart(self) -> None:
        """Make the law again, if it failed."""
        if self.failure is None:
            return
        try:
            self._law, self.failure = self._make(), None
        except Exception as error:
            self._failed(error)

    def _failed(self, error: Exception) -> None:
        line = f"the law failed: {type(error).__name__}: {error}{where(error)}"
        self.failure = Reason(LAW_FAILED, line)
        text = "".join(traceback.format_exception(error))
        logging.getLogger(self._name).error("%s", f"{line}\n{text.rstrip()}")


def where(error: Exception) -> str:
    """Return the file positions of `error`, the law's first, in one line."""
    frames = [f for f in traceback.extract_tb(error.__traceback__) if f"{OWN}/guarded_law" not in f.filename]
    frames = [f for f in frames if "flockwire/law.py" not in f.filename and "flockwire/own_law.py" not in f.filename]
    places = [f"{frame.filename.rsplit('/', maxsplit=1)[-1]}:{frame.lineno}" for frame in frames[-MOST_FRAMES:]]
    return f" ({' > '.join(places)})" if places else ""
