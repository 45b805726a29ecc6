"""Recomputes a flight's figures from its trace, sharing no code with flockwire: rosbags decodes, plain loops compute.

The formation is written out here once more: the paper's circle.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from pathlib import Path

from rosbags.highlevel import AnyReader

Track = list[tuple[int, tuple[float, float, float]]]


def read(trace: Path) -> dict[str, list[object]]:
    """Return the decoded messages by topic."""
    found: dict[str, list[object]] = {}
    with AnyReader([trace]) as reader:
        for connection, _, raw in reader.messages():
            found.setdefault(connection.topic, []).append(reader.deserialize(raw, connection.msgtype))
    return found


def _stamp(message: object) -> int:
    stamp = message.header.stamp
    return stamp.sec * 10**9 + stamp.nanosec


def _at(track: Track, stamp: int) -> tuple[float, float, float]:
    k = min(max(bisect_right(track, (stamp, (math.inf,) * 3)) - 1, 0), len(track) - 2)
    (t0, a), (t1, b) = track[k], track[k + 1]
    s = (stamp - t0) / (t1 - t0)
    return tuple(p + s * (q - p) for p, q in zip(a, b, strict=True))


def figures(trace: Path, swarm: str, radius: float, rate: float) -> dict[str, float]:
    """Return the largest tail errors and the smallest distance (m) of a flight of four followers."""
    topics = read(trace)
    missions = topics[f"/{swarm}/mission"]
    start = next(m.start.sec * 10**9 + m.start.nanosec for m in missions if m.verb == "start")
    takeoff = next(_stamp(m) for m in missions if m.verb == "takeoff")
    end = next(_stamp(m) for m in missions if m.verb == "land")
    tail = start + 0.7 * (end - start)
    tracks = {}
    for i in range(5):
        poses = topics[f"/{swarm}/uav{i}/truth"]
        tracks[i] = [(_stamp(m), (m.pose.position.x, m.pose.position.y, m.pose.position.z)) for m in poses]
    observation = formation = 0.0
    for i in range(1, 5):
        for m in topics[f"/{swarm}/uav{i}/estimate"]:
            stamp = _stamp(m)
            if tail <= stamp <= end:
                leader = _at(tracks[0], stamp)
                observation = max(observation, math.dist((m.position.x, m.position.y, m.position.z), leader))
        for stamp, place in tracks[i]:
            if tail <= stamp <= end:
                angle = rate * (stamp - start) / 1e9 + (i - 1) * math.pi / 2
                leader = _at(tracks[0], stamp)
                goal = (leader[0] + radius * math.sin(angle), leader[1] + radius * math.cos(angle), leader[2])
                formation = max(formation, math.dist(place, goal))
    nearest = math.inf
    for stamp in range(takeoff, end, 10**7):
        places = [_at(tracks[i], stamp) for i in range(5)]
        nearest = min(nearest, *(math.dist(places[i], places[j]) for i in range(5) for j in range(i)))
    return {"observation": observation, "formation": formation, "nearest": nearest}
