"""The interface of a control law: what docs/own_law.md describes, and no other module of flockwire is needed.

Imports no more than a drone has loaded already.
"""

from flockwire_core.law import (
    RELAYING,
    SECOND,
    ZERO,
    Body,
    BodyKind,
    Decision,
    Finite,
    Heard,
    Information,
    Law,
    LawSettings,
    LeaderMotion,
    Motion,
    NotNegative,
    Observation,
    Output,
    Pace,
    Parameters,
    Place,
    Positive,
    Seen,
    Sense,
    Share,
    Vector,
    add,
    distance,
    limit,
    norm,
    scale,
    subtract,
)
from flockwire_core.wire.observed_numbers import ObservedNumbers

__all__ = [
    "RELAYING", "SECOND", "ZERO", "Body", "BodyKind", "Decision", "Finite", "Heard", "Information", "Law",
    "LawSettings", "LeaderMotion", "Motion", "NotNegative", "Observation", "ObservedNumbers", "Output", "Pace",
    "Parameters", "Place", "Positive", "Seen", "Sense", "Share", "Vector", "add", "distance", "limit", "norm", "scale",
    "subtract",
]  # fmt: skip
