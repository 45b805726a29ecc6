"""The interface of a control law: what docs/own_law.md describes, and no other module of flockwire is needed.

Imports no more than a drone has loaded already.
"""

from flockwire_core.law import (
    SECOND,
    ZERO,
    Body,
    BodyKind,
    Decision,
    Finite,
    Law,
    LawSettings,
    LeaderMotion,
    Motion,
    NeighbourEstimate,
    NotNegative,
    Observation,
    Parameters,
    Positive,
    Reference,
    Vector,
    add,
    distance,
    limit,
    norm,
    scale,
    subtract,
)

__all__ = [
    "SECOND", "ZERO", "Body", "BodyKind", "Decision", "Finite", "Law", "LawSettings", "LeaderMotion", "Motion",
    "NeighbourEstimate", "NotNegative", "Observation", "Parameters", "Positive", "Reference", "Vector",
    "add", "distance", "limit", "norm", "scale", "subtract",
]  # fmt: skip
