"""Rotation and offset from the tracker's frame to the field's, from bodies at known places."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from flockwire_core.domain.pose import Quaternion
from flockwire_core.domain.vector import Vector
from flockwire_core.swarm.wording import InputError
from scipy.spatial.transform import Rotation


class AlignmentError(InputError):
    """Places that do not determine a rotation; the text says what is missing."""


class Alignment(NamedTuple):
    """A point p of the tracker is `rotation` · p + `offset` on the field; `residuals` remain, m."""

    rotation: Quaternion
    offset: Vector
    residuals: tuple[float, ...]

    @property
    def doubtful(self) -> bool:
        """Whether a body is at a wrong place, or two are exchanged."""
        # m: a body that is so far beside its place is not where it should be, or is another one
        return max(self.residuals) > 0.05

    def table(self) -> Iterator[str]:
        """Yield the lines of the swarm file's table [gateway]."""
        yield "[gateway]"
        yield f"rotation = [{', '.join(f'{part:.6f}' for part in self.rotation)}]"
        yield f"offset = [{', '.join(f'{part:.4f}' for part in self.offset)}]"


def align_bodies(seen: Mapping[str, Vector], known: Mapping[str, Vector]) -> Alignment:
    """Return the alignment by the bodies of `known`: where the tracker has seen each (its axes) and where it is, m.

    Raises AlignmentError, also for a body that it has not seen.
    """
    if missing := [name for name in known if name not in seen]:
        raise AlignmentError(f"the tracker does not see {', '.join(missing)}; it sees {', '.join(seen) or 'nothing'}")
    return align([seen[name] for name in known], list(known.values()))


def align(measured: Sequence[Vector], known: Sequence[Vector]) -> Alignment:
    """Return the rigid motion that brings `measured` (m, tracker's axes) closest to `known` (m, field).

        min sum |R p_k + o − q_k|²        (W. Kabsch, 1976)

    Three places that are not on a line are enough; more show how good it is. Raises AlignmentError.
    """
    if len(measured) < 3:
        raise AlignmentError(f"{len(measured)} bodies: at least three on known places are needed")
    p, q = np.asarray(measured, float), np.asarray(known, float)
    if min(_width(p), _width(q)) < 0.02:  # m: places nearer to a line do not determine the rotation about it
        raise AlignmentError("the bodies are on a line: move one of them aside")
    centre, target = p.mean(axis=0), q.mean(axis=0)
    turn, _ = Rotation.align_vectors(q - target, p - centre)
    offset = target - turn.apply(centre)
    residuals = np.linalg.norm(turn.apply(p) + offset - q, axis=1)
    (x, y, z), (qx, qy, qz, qw) = offset.tolist(), turn.as_quat().tolist()
    return Alignment((qx, qy, qz, qw), (x, y, z), tuple(residuals.tolist()))


def _width(places: np.ndarray[tuple[int, int], np.dtype[np.float64]]) -> float:
    """Return the distance of places from their best line: their second singular value, per place, m."""
    spread = np.linalg.svd(places - places.mean(axis=0), compute_uv=False)
    return float(spread[1] / np.sqrt(len(places)))
