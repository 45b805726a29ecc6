"""The phases of processes, as one word in a status."""

from __future__ import annotations

from enum import StrEnum


class Phase(StrEnum):
    """The phase of a process.

    A driver, a plugged-in kind of process, and a director also use their own words.
    """

    # a pilot
    GROUNDED = "grounded"
    READY = "ready"
    TAKEOFF = "take-off"
    HOLD = "hold"
    FORMATION = "formation"
    LANDING = "landing"
    STOPPED = "stopped"
    # any other process
    STARTING = "starting"
    WAITING = "waiting"
    SERVING = "serving"
    # gateway and tracked leader
    TRACKING = "tracking"
    TRACKED = "tracked"
    POSE_LOST = "pose lost"
    # recorder
    RECORDING = "recording"
    FULL = "full"  # its disk is full
    # simulated bodies, router, teleop
    SIMULATING = "simulating"
    ROUTING = "routing"
    STEERING = "steering"


PILOT_PHASES = (
    Phase.GROUNDED, Phase.READY, Phase.TAKEOFF, Phase.HOLD, Phase.FORMATION, Phase.LANDING, Phase.STOPPED,
)  # fmt: skip
_PHASES = {str(phase): phase for phase in Phase}


def phase_of(text: str) -> str:
    """Return the Phase of `text`, or a process's own word unchanged."""
    return _PHASES.get(text, text)
