"""Conducts a flight as an operator would: take off when all are ready, start when all hold, land when time is up."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum

from flockwire.flight.phases import Phase
from flockwire.nanoseconds import BILLION
from flockwire.wire.messages import Mission
from flockwire.wire.status import Status

POLL_PERIOD = 0.05  # s between two looks at the statuses

LEAD_TIME = BILLION // 2  # ns from the order to start until the formation's time 0, so that all begin together
PATIENCE = 30 * BILLION  # ns that a stage may take
GRACE = BILLION  # ns that a pilot which begins anew in flight may say that it is grounded, until it knows better
STALE = 2 * BILLION  # ns after which a status says nothing


class Stage(StrEnum):
    """How far a flight is."""

    PREPARING = "preparing"
    TAKING_OFF = "taking off"
    FLYING = "in formation"
    LANDING = "landing"
    OVER = "over"


class Director:
    """Conducts the flight of `pilots` (identities) for `duration` s from take-off to landing (0: until told)."""

    def __init__(self, pilots: tuple[str, ...], frame: str, duration: float, now: int) -> None:
        self.stage = Stage.PREPARING
        self.failure = ""
        self._pilots, self._frame = pilots, frame
        self._duration = round(duration * BILLION)
        self.took_off: int | None = None  # when the order to take off was given, Unix ns
        self._since = self._took_off = now
        self._grounded: dict[str, int] = {}  # since when pilots have said in flight that they are grounded

    def step(self, statuses: Mapping[str, Status], now: int) -> Mission | None:
        """Return the order that is due at `now` (Unix ns), None when there is none."""
        phases = {
            i: statuses[i].report.phase for i in self._pilots if i in statuses and now - statuses[i].stamp < STALE
        }
        if self.stage is Stage.PREPARING and self._all(phases, Phase.READY):
            self._took_off = self.took_off = now
            return self._go(Stage.TAKING_OFF, Mission(now, self._frame, "takeoff"))
        if self.stage is Stage.TAKING_OFF and self._all(phases, Phase.HOLD):
            return self._go(Stage.FLYING, Mission(now, self._frame, "start", now + LEAD_TIME))
        if self.stage is Stage.FLYING:
            lost = next((i for i in self._pilots if self._is_lost(i, phases.get(i), now)), None)
            if lost is not None:
                why = _why(statuses, lost) if lost in phases else "silent"
                return self._fail(f"{lost} left the formation: {why}", now)
            if self._duration and now - self._took_off >= self._duration:
                return self.land(now)
        if self.stage is Stage.LANDING:
            told = {i: phase for i, phase in phases.items() if statuses[i].stamp > self._since}
            silent = [i for i in self._pilots if i not in phases]
            if all(told.get(i) in (Phase.GROUNDED, Phase.READY, Phase.STOPPED) or i in silent for i in self._pilots):
                self.stage = Stage.OVER
        if self.stage not in (Stage.FLYING, Stage.OVER) and now - self._since > PATIENCE:
            return self._out_of_patience(statuses, phases, now)
        return None

    def land(self, now: int) -> Mission | None:
        """Return the order to land, None when nobody is in flight (the flight is then over)."""
        if self.stage in (Stage.PREPARING, Stage.OVER):
            self.stage = Stage.OVER
            return None
        return self._go(Stage.LANDING, Mission(now, self._frame, "land"))

    def abort(self, reason: str, now: int) -> Mission | None:
        """Land because of `reason`, which becomes the flight's failure."""
        return self._fail(reason, now)

    def _all(self, phases: Mapping[str, str], phase: Phase) -> bool:
        return all(phases.get(pilot) == phase for pilot in self._pilots)

    def _is_lost(self, pilot: str, phase: str | None, now: int) -> bool:
        """Return whether a pilot in `phase` (None: silent) flies no more."""
        if phase != Phase.GROUNDED:
            self._grounded.pop(pilot, None)
            return phase in (None, Phase.LANDING, Phase.STOPPED)
        return now - self._grounded.setdefault(pilot, now) >= GRACE

    def _go(self, stage: Stage, order: Mission) -> Mission:
        self.stage, self._since = stage, order.stamp
        return order

    def _fail(self, reason: str, now: int) -> Mission | None:
        self.failure = self.failure or reason
        return self.land(now) if self.stage is not Stage.LANDING else None

    def _out_of_patience(self, statuses: Mapping[str, Status], phases: Mapping[str, str], now: int) -> Mission | None:
        wanted = {Stage.PREPARING: Phase.READY, Stage.TAKING_OFF: Phase.HOLD}.get(self.stage, Phase.GROUNDED)
        late = [i for i in self._pilots if phases.get(i) != wanted]
        reasons = "; ".join(f"{i}: {_why(statuses, i)}" for i in late)
        was, order = self.stage, self._fail(f"still {self.stage} after {PATIENCE // BILLION} s ({reasons})", now)
        if was is Stage.LANDING:
            self.stage = Stage.OVER
        return order


def _why(statuses: Mapping[str, Status], identity: str) -> str:
    if identity not in statuses:
        return "no status"
    report = statuses[identity].report
    return report.detail or report.phase
