"""The processes whose cores a fault may wrap, by the process table."""

from __future__ import annotations

from flockwire_core.wire.plan import Plan
from flockwire_core.wire.processes import AGENT, GATEWAY, KINEMATICS, TRACKER

CAMERAS = (GATEWAY, TRACKER)  # where cameras are simulated
AIRFRAMES = (KINEMATICS,)
FOLLOWERS = (AGENT,)
WRAPPED = (*CAMERAS, *AIRFRAMES, *FOLLOWERS)


def targets(plan: Plan) -> tuple[str, ...]:
    """Return the processes that a fault may name: a flight is judged by the recorder's trace and its operators."""
    return tuple(identity for identity in plan.identities if identity not in (*plan.recorders, *plan.operators))
