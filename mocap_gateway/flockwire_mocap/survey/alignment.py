"""Rotation and offset from the tracker's frame to the field's, from bodies on known places."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from flockwire.domain.vector import Vector
from scipy.spatial.transform import Rotation

from flockwire_mocap.quaternion import Quaternion

COLLINEAR = 0.02  # m: places that lie nearer to a line leave the rotation about it open


class AlignmentError(ValueError):
    """Places that do not determine a rotation; the text says what is missing."""


class Alignment(NamedTuple):
    """A point p of the tracker is `rotation` · p + `offset` on the field; `residuals` are what is left, m."""

    rotation: Quaternion
    offset: Vector
    residuals: tuple[float, ...]


def align(measured: Sequence[Vector], known: Sequence[Vector]) -> Alignment:
    """Return the rigid motion that brings `measured` (m, tracker's axes) closest to `known` (m, field).

        min sum |R p_k + o − q_k|²        (W. Kabsch, 1976)

    Three places that are not on a line are enough; more show how good it is. Raises AlignmentError.
    """
    if len(measured) < 3:
        raise AlignmentError(f"{len(measured)} bodies: at least three on known places are needed")
    p, q = np.asarray(measured, float), np.asarray(known, float)
    if min(_width(p), _width(q)) < COLLINEAR:
        raise AlignmentError("the bodies stand on a line: put one of them aside")
    centre, target = p.mean(axis=0), q.mean(axis=0)
    turn, _ = Rotation.align_vectors(q - target, p - centre)
    offset = target - turn.apply(centre)
    residuals = np.linalg.norm(turn.apply(p) + offset - q, axis=1)
    (x, y, z), (qx, qy, qz, qw) = offset.tolist(), turn.as_quat().tolist()
    return Alignment((qx, qy, qz, qw), (x, y, z), tuple(residuals.tolist()))


def _width(places: np.ndarray[tuple[int, int], np.dtype[np.float64]]) -> float:
    """Return how far places are from the line that fits them best: their second singular value, per place, m."""
    spread = np.linalg.svd(places - places.mean(axis=0), compute_uv=False)
    return float(spread[1] / np.sqrt(len(places)))
