"""Converts trajectories of other programs to key frames: one function for each format; lengths m, times s."""

from __future__ import annotations

import csv
import json
import re
import zipfile
from collections.abc import Iterator, Sequence
from itertools import pairwise
from math import ceil, comb, isfinite
from pathlib import Path, PurePosixPath
from typing import Any

from flockwire_core.control.key_frames import HEADER
from flockwire_core.domain.vector import Vector, subtract
from flockwire_core.swarm.reading import LARGEST, read_text

Track = list[tuple[float, Vector]]
SKYBRUSH = ("time [msec]", "x [m]", "y [m]", "z [m]")
POSE = 8  # numbers of a TUM row
UNKNOWN = (
    "is none of: Crazyswarm's CSV (duration,x^0,…), Skybrush's CSV (Time [msec],x [m],…), zip of those or .skyc, "
    "TUM (timestamp tx ty tz qx qy qz qw)"
)


def tracks(path: Path, rate: float) -> Iterator[Track]:
    """Yield the trajectories in a file, in the order of its drones, as points at up to `rate` Hz.

    Raises OSError, and ValueError that names file, line and rule.
    """
    if zipfile.is_zipfile(path):
        with zipfile.ZipFile(path) as archive:
            yield from _archived(archive, rate)
        return
    yield _of_text(read_text(path), rate)


def key_frames(found: Sequence[Track], origin: Vector) -> str:
    """Return the key frames' CSV of trajectories, for the followers by rank: their places from `origin`."""
    rows = [",".join(HEADER)]
    for rank, track in enumerate(found, 1):
        for t, point in track:
            x, y, z = subtract(point, origin)
            rows.append(f"{t:.6g},{rank},{x:.6g},{y:.6g},{z:.6g}")
    return "\n".join(rows) + "\n"


def _of_text(text: str, rate: float) -> Track:
    lines = [line.strip() for line in text.splitlines()]
    first = next((line for line in lines if line and not line.startswith("#")), "").lower()
    if first.startswith("duration"):
        return crazyswarm(lines, rate)
    if first.startswith(SKYBRUSH[0]):
        return skybrush_csv(lines, rate)
    if len(re.split(r"[\s,]+", first)) == POSE:
        return tum(lines, rate)
    raise ValueError(UNKNOWN)


def crazyswarm(lines: Sequence[str], rate: float) -> Track:
    """Return the points of Crazyswarm's polynomials: x(t) = sum_k c_k t^k in each piece, from its begin on."""
    piece = 33  # numbers of a Crazyswarm piece: its duration, and 8 coefficients each of x, y, z, yaw
    track: Track = []
    begin = 0.0
    for number, row in _rows(lines[1:], ",", piece, 2):
        duration = row[0]
        if duration <= 0.0:
            raise ValueError(f"line {number}: duration = {duration:g}: must be above 0")
        axes = [row[1 + 8 * axis : 9 + 8 * axis] for axis in range(3)]
        for s in _shares(duration, rate, not track):
            t = s * duration
            x, y, z = (sum(c * t**k for k, c in enumerate(axis)) for axis in axes)
            track.append((begin + t, (x, y, z)))
        begin += duration
    return _complete(track)


def skybrush_csv(lines: Sequence[str], rate: float) -> Track:
    """Return the points of one drone's CSV of Skybrush; colours are left out."""
    header = [name.strip().lower() for name in lines[0].split(",")]
    if not set(SKYBRUSH) <= set(header):
        raise ValueError(f"line 1: header is {lines[0]!r}, must have {', '.join(SKYBRUSH)}")
    places = [header.index(name) for name in SKYBRUSH]
    rows = ((number, [row[k] for k in places]) for number, row in _rows(lines[1:], ",", len(header), 2))
    return _thinned([(number, (1e-3 * t, (x, y, z))) for number, (t, x, y, z) in rows], rate)


def tum(lines: Sequence[str], rate: float) -> Track:
    """Return the points of a trajectory in TUM's format, from time 0 on; orientations are left out."""
    rows = [(number, (row[0], (row[1], row[2], row[3]))) for number, row in _rows(lines, None, POSE, 1)]
    begin = rows[0][1][0] if rows else 0.0
    return _thinned([(number, (t - begin, point)) for number, (t, point) in rows], rate)


def skyc(show: dict[str, Any], archive: zipfile.ZipFile, rate: float) -> Iterator[Track]:
    """Yield the points of each drone of a compiled Skybrush show: Bezier curves through [t, [x, y, z], [control …]].

    The control points of a curve stand at its end; times count from the drone's takeoffTime.
    """
    try:
        drones = [drone["settings"]["trajectory"] for drone in show["swarm"]["drones"]]
        for given in drones:
            reference = given.get("$ref", "").partition("#")[0]
            trajectory = json.loads(_read(archive, str(PurePosixPath(reference)))) if reference else given
            if trajectory.get("version") != 1:
                raise ValueError(f"version = {trajectory.get('version')!r} of a trajectory: must be 1")
            yield _bezier(trajectory["points"], float(trajectory.get("takeoffTime", 0.0)), rate)
    except (KeyError, TypeError, AttributeError, IndexError) as error:
        raise ValueError(f"show.json is not that of a Skybrush show: {type(error).__name__}: {error}") from None


def _bezier(points: list[Any], takeoff: float, rate: float) -> Track:
    track: Track = []
    for before, (end, point, control) in pairwise([points[0], *points]):
        begin, ends = float(before[0]), [tuple(map(float, one[:3])) for one in (before[1], *control, point)]
        for s in _shares(end - begin, rate, not track):
            degree = len(ends) - 1
            weights = [comb(degree, k) * s**k * (1.0 - s) ** (degree - k) for k in range(degree + 1)]
            x, y, z = (sum(w * one[axis] for w, one in zip(weights, ends, strict=True)) for axis in range(3))
            track.append((takeoff + begin + s * (end - begin), (x, y, z)))
    return _complete(track)


def _archived(archive: zipfile.ZipFile, rate: float) -> Iterator[Track]:
    """Yield the trajectories in a zip file: a show, or a CSV for each drone, by the numbers in their names."""
    names = archive.namelist()
    if "show.json" in names:
        yield from skyc(json.loads(_read(archive, "show.json")), archive, rate)
        return
    tables = [name for name in names if name.lower().endswith(".csv")]
    if not tables:
        raise ValueError(UNKNOWN)
    for name in sorted(
        tables, key=lambda name: [int(part) if part.isdigit() else part for part in re.split(r"(\d+)", name)]
    ):
        try:
            yield _of_text(_read(archive, name), rate)
        except ValueError as error:
            raise ValueError(f"{name}: {error}") from None


def _read(archive: zipfile.ZipFile, name: str) -> str:
    size = archive.getinfo(name).file_size
    if size > LARGEST:
        raise ValueError(f"{name} has {size} bytes, must have {LARGEST} or fewer")
    return archive.read(name).decode("utf-8-sig")


def _rows(lines: Sequence[str], separator: str | None, count: int, first: int) -> Iterator[tuple[int, list[float]]]:
    """Yield the number of each line, and its finite numbers; empty lines and comments are skipped."""
    for number, line in enumerate(lines, first):
        if not line or line.startswith("#"):
            continue
        cells = next(csv.reader([line])) if separator else re.split(r"[\s,]+", line)
        try:
            row = [float(cell) for cell in cells[:count]]
        except ValueError:
            row = []
        if len(row) != count or not all(map(isfinite, row)):
            raise ValueError(f"line {number}: {line[:60]!r}: must be {count} finite numbers")
        yield number, row


def _shares(duration: float, rate: float, first: bool) -> list[float]:
    """Return the evenly spaced shares of a piece, its end included, at up to `rate` Hz; its begin only at `first`."""
    steps = max(1, ceil(duration * rate - 1e-9)) if duration > 0.0 else 0
    return [k / steps for k in range(0 if first else 1, steps + 1)] if steps else [1.0] * first


def _thinned(rows: list[tuple[int, tuple[float, Vector]]], rate: float) -> Track:
    """Return points at up to `rate` Hz, and the last one; raises ValueError where the time does not grow."""
    track: Track = []
    for (_, (before, _)), (number, (t, _)) in pairwise(rows):
        if t <= before:
            raise ValueError(f"line {number}: the time {t:g} s must be later than {before:g} s")
    for number, (t, point) in rows:
        if not track or t - track[-1][0] >= 1.0 / rate - 1e-6 or number == rows[-1][0]:
            track.append((t, point))
    return _complete(track)


def _complete(track: Track) -> Track:
    if not track:
        raise ValueError("has no point")
    return track
