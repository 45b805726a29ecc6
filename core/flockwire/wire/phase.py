"""The phases of processes: what each one does, by one word in its status."""

from __future__ import annotations

from enum import StrEnum


class Phase(StrEnum):
    """What a process does.

    A driver, a kind of process that is plugged in, and who conducts a flight use words of their own beside these.
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
    FULL = "full"  # its disk takes no more
    # simulated bodies, router, a hand that steers
    SIMULATING = "simulating"
    ROUTING = "routing"
    STEERING = "steering"


_PHASES = {str(phase): phase for phase in Phase}


def phase_of(text: str) -> str:
    """Return the Phase that `text` stands for, and a word of a process's own as it is."""
    return _PHASES.get(text, text)
