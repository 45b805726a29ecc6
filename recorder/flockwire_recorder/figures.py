"""The paper's figures, drawn from a trace. Only this module and those it draws with know matplotlib, which is slow."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from matplotlib import rc_context

from flockwire_recorder import distance_figures, error_figures, motion_figures
from flockwire_recorder.drawing import STYLE, Canvas
from flockwire_recorder.latency_figure import latency
from flockwire_recorder.picture import Picture
from flockwire_recorder.recorded import Trace
from flockwire_recorder.trajectories import trajectories

FIGURES: tuple[Callable[[Canvas], Picture | None], ...] = (
    trajectories,
    error_figures.formation,
    error_figures.observation,
    error_figures.convergence,
    motion_figures.positions,
    motion_figures.estimates,
    motion_figures.speeds,
    motion_figures.commands,
    distance_figures.between_drones,
    distance_figures.to_obstacles,
    latency,
)


def draw(trace: Trace, out: Path, vector: bool = False) -> tuple[Picture, ...]:
    """Draw every figure that the trace has something for into the folder `out`, as PNG, and as PDF if `vector`."""
    canvas = Canvas(trace, out, vector)
    with rc_context(STYLE):
        return tuple(picture for figure in FIGURES if (picture := figure(canvas)) is not None)
