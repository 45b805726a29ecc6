"""How often a driver reports, and how long its process waits before it ends: the same for all airframes."""

from __future__ import annotations

from flockwire.nanoseconds import BILLION

TELEMETRY_PERIOD = BILLION // 10  # ns
SETTLED = BILLION  # ns that all drones are on the ground before the process may end
RETIREMENT = 20 * BILLION  # ns that pilots have to land their drones when the process is to end
