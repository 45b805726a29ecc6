"""The paper's figures, drawn from a trace. Only this package imports matplotlib, which is slow."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from matplotlib import rc_context

from flockwire_analysis.figures import distances, errors, motion
from flockwire_analysis.figures.drawing import STYLE, Canvas, Picture
from flockwire_analysis.figures.graph import graph
from flockwire_analysis.figures.latency import latency
from flockwire_analysis.figures.trajectories import trajectories
from flockwire_analysis.recorded import Trace

FIGURES: tuple[Callable[[Canvas], Picture | None], ...] = (
    trajectories, errors.formation, errors.observation, errors.convergence, motion.positions, motion.estimates,
    motion.speeds, motion.commands, motion.accelerations, distances.between_drones, distances.to_obstacles, latency,
    motion.signals, graph,
)  # fmt: skip


def draw(trace: Trace, out: Path, vector: bool = False) -> tuple[Picture, ...]:
    """Draw every figure with data in the trace into the folder `out`, as PNG, and as PDF if `vector`."""
    canvas = Canvas(trace, out, vector)
    with rc_context(STYLE):
        return tuple(picture for figure in FIGURES if (picture := figure(canvas)) is not None)
