"""A flight as a moving picture, from above, from the side or in 3-D: GIF, or MP4 where ffmpeg is installed."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from itertools import chain
from pathlib import Path
from shutil import which
from subprocess import PIPE, Popen
from tempfile import TemporaryFile
from typing import Any, NamedTuple

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon
from PIL import Image

from flockwire_analysis.figures.drawing import COLUMN, MOST_NAMED, MUTED, NAME_SIZE, STYLE, Canvas, legend
from flockwire_analysis.figures.trajectories import SMALLEST_DISC, obstacles
from flockwire_analysis.figures.trajectories import view as field
from flockwire_analysis.phases import Span
from flockwire_analysis.recorded import Trace
from flockwire_analysis.series import Floats
from flockwire_analysis.tracking import interpolated

RATE = 12  # frames per second of a GIF
FILM_RATE = 25  # of an MP4
EVEN = "pad=ceil(iw/2)*2:ceil(ih/2)*2:color=white"  # as its coding needs the sides
FEWEST = 24  # frames
LARGEST = 3_000_000  # bytes


class View(NamedTuple):
    """What a picture shows of a place (m): `axes` is the matrix to its right and up, with the `labels` of both."""

    axes: tuple[tuple[float, float, float], tuple[float, float, float]]
    labels: tuple[str, str]

    def seen(self, places: Floats) -> Floats:
        """Return the coordinates in the picture of `places`, shape n x 3."""
        return np.asarray(places @ np.array(self.axes).T)


VIEWS = {
    "above": View(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), ("x (east), m", "y (north), m")),
    "side": View(((1.0, 0.0, 0.0), (0.0, 0.0, 1.0)), ("x (east), m", "z (up), m")),
    "3-D": View(((0.87, 0.5, 0.0), (-0.25, 0.43, 0.87)), ("", "")),  # turned by 30 degrees, from 30 degrees above
}


def animate(trace: Trace, path: Path, seconds: float = 10.0, view: str = "above", width: int = 455) -> Path:
    """Write the whole flight as a GIF or MP4, by the name of `path`, that plays for `seconds`; returns `path`.

    It is seen by one of VIEWS, in pictures of about `width` pixels.

    Every frame has the drones, their names and trails of 5 s, the followers' polygon, obstacles and the flight's
    time. Frames of a GIF are left out, down to FEWEST, while the file is larger than LARGEST bytes. Raises ValueError
    for a trace without positions, if the GIF is still too large, or for an MP4 without ffmpeg; OSError if `path` cannot
    be written.
    """
    if path.suffix == ".mp4":
        return _film(_frames(trace, max(FEWEST, round(seconds * FILM_RATE)), VIEWS[view], width), path)
    frames = _with_one_palette(list(_frames(trace, max(FEWEST, round(seconds * RATE)), VIEWS[view], width)))
    while True:
        step = round(1000 * seconds / len(frames))
        frames[0].save(path, "GIF", save_all=True, append_images=frames[1:], duration=step, loop=0, optimize=False)
        if path.stat().st_size <= LARGEST:
            return path
        if len(frames) // 2 < FEWEST:
            path.unlink()
            raise ValueError(f"{path}: {len(frames)} frames take more than {LARGEST / 1e6:g} MB; choose fewer seconds")
        frames = frames[::2]


def _film(frames: Iterator[Image.Image], path: Path) -> Path:
    program = which("ffmpeg")
    if program is None:
        raise ValueError(f"{path}: an MP4 needs the program ffmpeg, which is not installed; write a .gif")
    first = next(frames)
    size = f"{first.width}x{first.height}"
    line = [program, "-y", "-loglevel", "error", "-f", "rawvideo", "-pixel_format", "rgb24", "-video_size", size]
    line += ["-framerate", str(FILM_RATE), "-i", "-", "-vf", EVEN, "-pix_fmt", "yuv420p", "-movflags", "+faststart"]
    with TemporaryFile() as errors:
        with Popen([*line, str(path)], stdin=PIPE, stderr=errors) as film, suppress(BrokenPipeError):  # noqa: S603
            assert film.stdin is not None  # noqa: S101  (a pipe)
            for frame in chain((first,), frames):
                film.stdin.write(frame.tobytes())
        errors.seek(0)
        if film.returncode:
            raise OSError(f"{path}: ffmpeg: {errors.read().decode(errors='replace').strip()}")
    return path


def _frames(trace: Trace, count: int, view: View, width: int) -> Iterator[Image.Image]:
    """Draw `count` frames from the first order to the end."""
    fine = 6  # points of a trail for each frame
    canvas = Canvas(trace, Path(), vector=False)
    numbers = trace.placed()
    if not numbers:
        raise ValueError(f"{trace.path}: has no positions")
    last = min(int(trace.positions(number).stamps[-1]) for number in numbers)
    shown = Span(canvas.flight.begin, min(canvas.flight.end, last))
    instants = shown.instants(count * fine)
    paths = {number: view.seen(interpolated(trace.positions(number), instants)) for number in numbers}
    with rc_context(STYLE):
        figure, (axes,) = canvas.panels(height=3.7)
        _still(axes, canvas, paths, view)
        lasts = 5.0  # s of the flight, of a trail
        trail = max(1, round(lasts * len(instants) / max(shown.length, lasts)))
        scene = _Scene(axes, canvas, paths, trail)
        figure.set_dpi(width / COLUMN)
        agg: Any = FigureCanvasAgg(figure)  # matplotlib has no types for it
        agg.draw()
        still = agg.copy_from_bbox(figure.bbox)
    for place in range(fine - 1, len(instants), fine):
        agg.restore_region(still)
        scene.draw(place, canvas.second(int(instants[place])))
        yield Image.fromarray(np.asarray(agg.buffer_rgba())[..., :3].copy())


def _with_one_palette(drawn: list[Image.Image]) -> list[Image.Image]:
    colours = 48
    nearly_white = 249  # of 255
    palette = drawn[-1].quantize(colours, Image.Quantize.MEDIANCUT)
    shades = palette.getpalette() or []
    palette.putpalette([255 if shade >= nearly_white else shade for shade in shades])  # the median of whites is grey
    return [one.quantize(palette=palette, dither=Image.Dither.NONE) for one in drawn]


def _still(axes: Axes, canvas: Canvas, paths: dict[int, Floats], view: View) -> None:
    """Draw what does not move, and choose the part of the field that is shown."""
    known = np.concatenate([path[np.isfinite(path).all(axis=1)] for path in paths.values()])
    axes.set_aspect("equal", adjustable="box")
    if view is VIEWS["above"]:
        obstacles(axes, canvas)
        field(axes, canvas, known)
    else:
        _cylinders(axes, canvas.trace, view)
        low, high = known.min(axis=0) - 0.3, known.max(axis=0) + 0.3
        axes.set_xlim(low[0], high[0])
        axes.set_ylim(low[1], high[1])
    if not any(view.labels):  # lengths along none of the three axes
        axes.tick_params(labelbottom=False, labelleft=False)
    axes.set_xlabel(view.labels[0])
    axes.set_ylabel(view.labels[1])
    legend(axes, canvas.names(paths))


def _cylinders(axes: Axes, trace: Trace, view: View) -> None:
    """Draw the obstacles: the foot and the top of each, and what is between them."""
    turns = np.linspace(0.0, 2.0 * np.pi, 49)
    for obstacle in trace.swarm.obstacles:
        x, y, _ = obstacle.center
        radius, top = max(obstacle.radius, SMALLEST_DISC), obstacle.height or trace.swarm.limits.fence.high[2]
        ring = np.stack([x + radius * np.cos(turns), y + radius * np.sin(turns), 0.0 * turns], axis=1)
        foot, lid = view.seen(ring), view.seen(ring + np.array([0.0, 0.0, top]))
        for one, other in zip(range(24), range(24, 48), strict=True):  # strips across it
            corners = np.stack([foot[one], lid[one], lid[other], foot[other]])
            axes.fill(*corners.T, color="#4a505c", alpha=0.03, linewidth=0)
        for circle in (foot, lid):
            axes.plot(*circle.T, color="#4a505c", linewidth=0.7)


class _Scene:
    """What moves: `paths` has the places at many instants, a trail the last `trail` of them."""

    def __init__(self, axes: Axes, canvas: Canvas, paths: dict[int, Floats], trail: int) -> None:
        self._axes, self._paths, self._trail = axes, paths, trail
        self._followers = [number for number in paths if number in canvas.trace.followers]
        self._trails = {number: self._line(axes, canvas.colour(number), 0.9, "") for number in paths}
        self._dots = {number: self._line(axes, canvas.colour(number), 0.0, "o") for number in paths}
        self._ring = Polygon(
            np.zeros((1, 2)), facecolor="#8d97a8", edgecolor=MUTED, alpha=0.25, linewidth=0.6, animated=True
        )
        axes.add_patch(self._ring)
        named = paths if len(paths) <= MOST_NAMED else ()
        self._names = {
            number: axes.annotate(
                canvas.name(number), (0.0, 0.0), (4, 4), textcoords="offset points", fontsize=NAME_SIZE, color=MUTED,
                animated=True, annotation_clip=True,
            )
            for number in named
        }  # fmt: skip
        self._clock = axes.text(
            0.99, 0.01, "", transform=axes.transAxes, ha="right", va="bottom", color=MUTED, animated=True
        )

    @staticmethod
    def _line(axes: Axes, colour: str, width: float, marker: str) -> Line2D:
        (line,) = axes.plot(
            [], [], color=colour, linewidth=width, marker=marker, markersize=6, markeredgecolor="white", animated=True
        )
        return line

    def draw(self, last: int, time: float) -> None:
        """Draw everything as at the instant `last`, `time` s after the formation's time 0."""
        for number, path in self._paths.items():
            recent = path[max(0, last - self._trail) : last + 1]
            self._trails[number].set_data(recent[:, 0], recent[:, 1])
            self._dots[number].set_data(path[last : last + 1, 0], path[last : last + 1, 1])
        for number, name in self._names.items():
            place = self._paths[number][last]
            name.xy = tuple(place)
            name.set_visible(bool(np.isfinite(place).all()))
        places = np.array([self._paths[number][last] for number in self._followers])
        known = places[np.isfinite(places).all(axis=1)] if len(places) else np.empty((0, 2))
        self._ring.set_visible(len(known) > 2)
        if len(known) > 2:
            centre = known.mean(axis=0)
            self._ring.set_xy(known[np.argsort(np.arctan2(*(known - centre).T[::-1]))])
        self._clock.set_text(f"t = {time:.1f} s")
        for artist in (self._ring, *self._trails.values(), *self._dots.values(), *self._names.values(), self._clock):
            self._axes.draw_artist(artist)
