"""From pose reports to frames of one body each: bodies keep their number through reconnections, repetitions go."""

from __future__ import annotations

from flockwire.nanoseconds import BILLION

from flockwire_mocap.tracking import ReportedBody, TrackerFrame
from flockwire_mocap.vrpn.connection import MOST_NAMES, PoseReport

RESTART = 10 * BILLION  # ns; a report that is older than that by its stamp comes from a clock that was set back


class Reports:
    """Counts reports: `frames` passed on, `repeated` and `late` ones dropped. VRPN has no numbers to count gaps with.

    A body is named by its sender; sensors other than 0 of one sender are bodies of their own, named sender/sensor.
    """

    def __init__(self) -> None:
        self.frames = self.repeated = self.late = 0
        self._identities: dict[str, int] = {}
        self._newest: dict[int, PoseReport] = {}

    def frame(self, report: PoseReport) -> TrackerFrame | None:
        """Return the report as a frame of one body, if it is newer than all before of that body."""
        sensor = report.pose.sensor
        name = report.name if sensor == 0 else f"{report.name}/{sensor}"
        if name not in self._identities and len(self._identities) >= MOST_NAMES:
            return None
        identity = self._identities.setdefault(name, len(self._identities))
        if not self._is_new(report, self._newest.get(identity)):
            return None
        self._newest[identity] = report
        self.frames += 1
        body = ReportedBody(identity, name, report.pose.position, report.pose.orientation, tracked=True)
        return TrackerFrame(self.frames, report.stamp, report.stamp, (body,))

    def _is_new(self, report: PoseReport, newest: PoseReport | None) -> bool:
        if newest is None or report.stamp > newest.stamp or newest.stamp - report.stamp > RESTART:
            return True
        if (report.stamp, report.pose) == (newest.stamp, newest.pose):
            self.repeated += 1
        else:
            self.late += 1
        return False
