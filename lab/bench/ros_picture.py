"""Draws the markers that a flight has in ROS 2, as a viewer draws them: docs/images/ros_markers.png.

    flockwire sim examples/paper_simulation.toml --duration 12 --out virtual
    python lab/bench/ros_picture.py virtual/trace.mcap docs/images/ros_markers.png --at 3.9

The messages are decoded by `rosbags`, independently of flockwire's codec. `--at` is in s from the trace's begin.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib.pyplot as plt
import numpy as np
from flockwire_analysis.reading import read_trace
from flockwire_core.domain.time import nanoseconds
from flockwire_core.ros.markers import Shape
from flockwire_operator.ros.replay import Replay, read_messages
from flockwire_operator.ros.topics import MARKER_ARRAY
from rosbags.typesys import Stores, get_typestore

if TYPE_CHECKING:
    from mpl_toolkits.mplot3d import Axes3D

STORE = get_typestore(Stores.ROS2_JAZZY)
POINTS_PER_M = 70.0  # size of a sphere in the picture
GRID = 5  # m from the middle to each side


def markers_at(trace: Path, seconds: float) -> list[Any]:
    """Return the markers that are published last before `seconds` (s from the trace's begin)."""
    plan = read_trace(trace).plan
    replay = Replay(plan, read_messages(plan, trace))
    published = replay.until(replay.begin)
    for step in range(1, round(seconds * 100)):
        published = replay.until(replay.begin + nanoseconds(step / 100)) or published
        newest = [payload for topic, payload in published if topic == MARKER_ARRAY]
        if newest:
            payload = newest[-1]
    return list(STORE.deserialize_cdr(payload, MARKER_ARRAY.ros_type).markers)


def draw(axes: Axes3D, marker: Any) -> None:  # noqa: ANN401  (its class is made by rosbags)
    """Draw one marker."""
    colour = (marker.color.r, marker.color.g, marker.color.b, marker.color.a)
    points = np.array([(p.x, p.y, p.z) for p in marker.points]).reshape(-1, 3)
    at = marker.pose.position
    match marker.type:
        case Shape.ARROW:
            axes.quiver(*points[0], *(points[1] - points[0]), color=colour, arrow_length_ratio=0.08, linewidth=1.2)
        case Shape.SPHERE:
            axes.plot(at.x, at.y, at.z, "o", color=colour, markersize=POINTS_PER_M * marker.scale.x)
        case Shape.CYLINDER:
            turn, up = np.meshgrid(np.linspace(0.0, 2.0 * np.pi, 33), (-0.5, 0.5))
            x, y = at.x + 0.5 * marker.scale.x * np.cos(turn), at.y + 0.5 * marker.scale.y * np.sin(turn)
            axes.plot_surface(x, y, at.z + up * marker.scale.z, color=colour)
        case Shape.LINE_LIST:
            for begin, end in zip(points[::2], points[1::2], strict=True):
                axes.plot(*zip(begin, end, strict=True), color=colour, linewidth=2.0)
        case Shape.TEXT:
            axes.text(at.x, at.y, at.z, marker.text, color=colour, fontsize=8, ha="center")


def draw_grid(axes: Axes3D) -> None:
    """Draw the floor's grid of 1 m."""
    for k in range(-GRID, GRID + 1):
        axes.plot((k, k), (-GRID, GRID), (0.0, 0.0), color="#5a5a5a", linewidth=0.6)
        axes.plot((-GRID, GRID), (k, k), (0.0, 0.0), color="#5a5a5a", linewidth=0.6)


def main() -> None:
    """Draw the picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("trace", type=Path)
    parser.add_argument("picture", type=Path)
    parser.add_argument("--at", type=float, default=3.9)
    options = parser.parse_args()
    figure = plt.figure(figsize=(8.0, 5.6), facecolor="#303030")
    axes = figure.add_axes((-0.25, -0.35, 1.5, 1.7), projection="3d", facecolor="#303030")
    found = [marker for marker in markers_at(options.trace, options.at) if marker.ns != "fence"]
    draw_grid(axes)
    for marker in found:
        draw(axes, marker)
    axes.set_axis_off()
    axes.set_aspect("equal")
    axes.margins(0.0)
    axes.view_init(elev=32.0, azim=-65.0)
    figure.savefig(options.picture, dpi=100)
    print(f"{len(found)} markers, {options.picture}")


if __name__ == "__main__":
    main()
