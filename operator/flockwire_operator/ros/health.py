"""The states of all processes as diagnostics of ROS 2, and that of the swarm in one."""

from __future__ import annotations

from collections.abc import Mapping

from flockwire_core.ground.fleet import STALE
from flockwire_core.pilot.off_place import shown_phase
from flockwire_core.ros import messages
from flockwire_core.ros.messages import DiagnosticStatus
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.status import Status

FAILED = frozenset({Phase.POSE_LOST, Phase.STOPPED, Phase.FULL})
BEGINNING = frozenset({Phase.WAITING, Phase.STARTING})
SILENT = "silent"


class Health:
    """Judges `statuses`, the newest of each process of `plan`."""

    def __init__(self, plan: Plan, statuses: Mapping[str, Status]) -> None:
        self._plan, self._statuses = plan, statuses
        self._told: tuple[str, ...] = ()

    def changed(self, now: int) -> bool:
        """Return whether the state of a process has changed since the last call of this method."""
        told, self._told = self._told, tuple([self._phase(identity, now) for identity in self._plan.started])
        return told != self._told

    def processes(self, now: int) -> list[DiagnosticStatus]:
        """Return the state of each process at `now` (Unix ns)."""
        return [self._process(identity, now) for identity in self._plan.started]

    def swarm(self, now: int) -> DiagnosticStatus:
        """Return the state of the swarm: the worst level, the phases of all drones, the order that they obey."""
        pilots = self._plan.pilots.values()
        phases = [self._phase(pilot, now) for pilot in pilots]
        most = max(phases, key=phases.count, default=SILENT)
        orders = [status.report.mission for pilot in pilots if (status := self._statuses.get(pilot)) is not None]
        newest = max((order for order in orders if order is not None), key=lambda order: order.stamp, default=None)
        errors = [status.report.formation_error for status in self._statuses.values()]
        values = [
            ("order", newest.verb if newest is not None else ""),
            ("formation", newest.formation if newest is not None else ""),
            ("largest formation error m", f"{max(errors, default=-1.0):.3f}"),
            *zip(pilots, phases, strict=True),
        ]
        level = max([self._level(identity, now) for identity in self._plan.started])
        message = f"{phases.count(most)} of {len(phases)} drones: {most}"
        return DiagnosticStatus(level, self._plan.swarm.name, message, self._plan.swarm.name, tuple(values))

    def _phase(self, identity: str, now: int) -> str:
        status = self._statuses.get(identity)
        return SILENT if status is None or now - status.stamp > STALE else shown_phase(status.report)

    def _level(self, identity: str, now: int) -> int:
        phase = self._phase(identity, now)
        if phase == SILENT:
            return messages.STALE
        report = self._statuses[identity].report
        if phase in FAILED:
            return messages.ERROR
        troubled = phase in BEGINNING or phase != report.phase or any(reason.remedy for reason in report.reasons)
        return messages.WARN if troubled else messages.OK

    def _process(self, identity: str, now: int) -> DiagnosticStatus:
        plan, status = self._plan, self._statuses.get(identity)
        name, phase = f"{plan.swarm.name}: {identity}", self._phase(identity, now)
        if status is None:
            return DiagnosticStatus(self._level(identity, now), name, phase, plan.hosts[identity], ())
        report = status.report
        figures = {
            "pose age s": report.pose_age,
            "estimate age s": report.estimate_age,
            "telemetry age s": report.telemetry_age,
            "formation error m": report.formation_error,
            "battery": report.battery,
            "latency s": report.latency,
        }
        values = [(what, f"{value:.4g}") for what, value in figures.items() if value >= 0.0]
        values += [("cpu", f"{status.cpu:.3f}"), ("steps", str(status.steps)), ("late 5 ms", str(status.delayed_5ms))]
        values += [("skipped", str(status.skipped)), ("links", str(len(status.links)))]
        values += [(what, str(count)) for what, count in (*report.counts, *status.rejected)]
        message = f"{phase}: {report.line}" if report.line else phase
        return DiagnosticStatus(self._level(identity, now), name, message, plan.hosts[identity], tuple(values))
