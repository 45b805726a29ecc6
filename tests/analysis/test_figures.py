"""What is in the figures: events that overlap nothing, one time axis, curves beside their references."""

import json
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from flockwire_analysis import FAULTS
from flockwire_analysis.figures import animation, distances, errors, motion
from flockwire_analysis.figures.animation import VIEWS, animate
from flockwire_analysis.figures.comparison import compare
from flockwire_analysis.figures.distances import between_drones, to_obstacles
from flockwire_analysis.figures.drawing import NAME_ROWS, STYLE, Canvas, line, rows_of
from flockwire_analysis.figures.errors import observation
from flockwire_analysis.figures.graph import graph
from flockwire_analysis.figures.trajectories import trajectories
from flockwire_analysis.phases import Event, events
from flockwire_analysis.reading import read_trace
from flockwire_analysis.tracking import Errors, places, references, velocities
from flockwire_core.domain.time import SECOND
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_hex
from matplotlib.patches import Circle
from PIL import Image


@pytest.fixture(scope="module")
def trace(good_flight):
    return read_trace(good_flight)


@pytest.fixture(scope="module")
def canvas(trace, tmp_path_factory):
    return Canvas(trace, tmp_path_factory.mktemp("figures"))


def test_names_of_events_that_are_close_stand_in_rows_of_their_own():
    marked = [Event(0, "takeoff"), Event(1, "start wide"), Event(2, "hold"), Event(90, "land")]
    assert rows_of(marked, [0.0, 0.01, 0.02, 0.9]) == [0, 1, 2, 0]


def test_the_name_of_an_order_does_not_stand_over_the_next_one_s_line(canvas):
    _, (axes,) = canvas.panels()
    canvas.over_time([axes])
    names = {text.get_text(): text.get_horizontalalignment() for text in axes.texts}
    assert names["takeoff"] == "right"  # it ends at its line; to the right it would be over t = 0
    assert names["start"] == "left"


@pytest.fixture
def drawn(canvas, monkeypatch):
    """Return the figures that are drawn from now on; none is written."""
    figures = []
    monkeypatch.setattr(canvas, "save", lambda figure, name: figures.append(figure) or Path(name))
    return figures


def test_the_graph_shows_every_drone_and_edge(canvas, drawn):
    graph(canvas)
    (axes,) = drawn[0].axes
    swarm = canvas.trace.swarm
    assert [text.get_text() for text in axes.texts if text.get_text()] == [str(i) for i in (0, *swarm.followers)]
    assert sum(text.arrow_patch is not None for text in axes.texts if hasattr(text, "arrow_patch")) == len(
        swarm.topology.edges
    )


def test_errors_below_the_axis_are_not_drawn_on_its_edge(canvas, drawn, monkeypatch):
    small = {1: Errors(np.arange(5) + canvas.phases[0].span.begin, np.array([1.0, 1e-2, 1e-6, 0.0, 1e-2]))}
    monkeypatch.setitem(canvas.__dict__, "observation_errors", small)
    observation(canvas)
    (axes,) = drawn[0].axes
    values = axes.lines[0].get_ydata()
    assert axes.get_ylim()[0] == pytest.approx(1e-4)
    assert values[2] == pytest.approx(1e-6)
    assert np.isnan(values[3])


def test_the_ring_round_an_obstacle_is_not_called_the_fence(canvas, drawn):
    trajectories(canvas)
    (legend,) = drawn[0].legends
    entries = zip(legend.get_texts(), legend.legend_handles, strict=True)
    colours = {text.get_text(): line.get_color() for text, line in entries}
    assert list(colours) == ["clearance of obstacles"]  # the fence is far out of view
    rings = [patch for patch in drawn[0].axes[0].patches if isinstance(patch, Circle) and not patch.get_fill()]
    assert to_hex(rings[0].get_edgecolor()) == colours["clearance of obstacles"]


def test_of_many_drones_each_is_drawn_to_the_nearest_and_not_every_pair(canvas, drawn, monkeypatch):
    pairs = between_drones(canvas)
    monkeypatch.setattr(distances, "MANY", 3)
    nearest = between_drones(canvas)
    greys = [[grey for grey in figure.axes[0].lines if grey.get_color() == distances.GREY] for figure in drawn]
    assert [len(lines) for lines in greys] == [10, 5]
    assert "Every pair" in pairs.caption
    assert "the nearest other one" in nearest.caption
    lowest = np.nanmin([np.nanmin(grey.get_ydata()) for grey in greys[0]])
    assert np.nanmin([np.nanmin(grey.get_ydata()) for grey in greys[1]]) == lowest


def test_accelerations_are_drawn_of_those_that_were_commanded_any(canvas, drawn, monkeypatch):
    assert motion.accelerations(canvas) is None
    series = canvas.trace.of("command", 2)
    values = np.hstack([series.values[:, :3], np.full((len(series), 3), (1.0, -2.0, 0.5))])
    monkeypatch.setitem(canvas.trace.series, ("command", "uav2"), replace(series, values=values))
    motion.accelerations(canvas)
    shown = [line.get_ydata() for axes in drawn[0].axes for line in axes.lines if len(line.get_ydata()) > 2]
    assert [set(values) for values in shown] == [{1.0}, {-2.0}, {0.5}]


@pytest.mark.parametrize("drones", [4, 12])
def test_no_legend_is_cut_off(trace, tmp_path, monkeypatch, drones):
    figures, canvas = [], Canvas(trace, tmp_path)
    monkeypatch.setattr(canvas, "save", lambda figure, name: figures.append(figure) or Path(name))
    names, many = canvas.names, [f"uav{k}" for k in range(drones - 4)]
    monkeypatch.setattr(canvas, "names", lambda numbers: [*names(numbers), *(line(name) for name in many)])
    with rc_context(STYLE):
        for draw in (trajectories, errors.formation, motion.positions, between_drones, to_obstacles):
            draw(canvas)
        for figure in figures:
            FigureCanvasAgg(figure).draw()
            legends = [*figure.legends, *(axes.get_legend() for axes in figure.axes if axes.get_legend())]
            assert legends
            for legend in legends:
                box, point = legend.get_window_extent(), figure.dpi / 72
                assert box.x0 >= 2 * point
                assert max(box.x1 - figure.bbox.width, box.y1 - figure.bbox.height) <= 0.0


def test_the_path_is_drawn_to_the_end_of_the_last_formation(tmp_path, write_flight, monkeypatch):
    write_flight(tmp_path / "trace.mcap", begin=-1.0, end=5.0, holds_at=1.0, resumes_at=2.0)
    canvas, figures = Canvas(read_trace(tmp_path / "trace.mcap"), tmp_path), []
    monkeypatch.setattr(canvas, "save", lambda figure, name: figures.append(figure) or Path(name))
    trajectories(canvas)
    (end,) = places(canvas.trace, 1, np.array([canvas.phases[-1].span.end]))[:, :2]
    markers = [dot.get_xydata()[0] for dot in figures[0].axes[0].lines if len(dot.get_xydata()) == 1]
    assert min(np.linalg.norm(marker - end) for marker in markers) < 1e-6


def test_a_name_for_which_there_is_no_room_is_left_out_its_line_is_not():
    marked = [Event(k, "hold") for k in range(NAME_ROWS + 2)]
    assert rows_of(marked, [0.5] * len(marked)) == [*range(NAME_ROWS), None, None]


def test_orders_and_injected_faults_are_events_in_the_order_of_time(trace):
    injected = json.dumps([[3.0, "kill uav2"], [0.5, "noise"]])
    found = [event.text for event in events(replace(trace, metadata={**trace.metadata, FAULTS: injected}))]
    assert found == ["takeoff", "noise", "start", "kill uav2", "land"]


def test_all_figures_over_time_have_one_axis(canvas):
    limits = set()
    for _ in range(3):
        _, panels = canvas.panels(2)
        canvas.over_time(panels)
        limits |= {axes.get_xlim() for axes in panels}
    assert len(limits) == 1


def test_a_settled_follower_is_where_and_as_fast_as_its_reference(trace):
    phase = Canvas(trace, None).phases[0].span
    times = np.arange(phase.begin + 5 * SECOND, phase.begin + 7 * SECOND, SECOND // 10)
    assert np.abs(places(trace, 1, times) - references(trace, 1, times)).max() < 0.05
    velocity = velocities(places, trace, 1, times)
    assert np.abs(velocity - velocities(references, trace, 1, times)).max() < 0.1
    assert np.abs(velocity).max() > 0.5


def test_hovering_and_landing_are_not_formation(trace, canvas):
    after = np.array([canvas.phases[0].span.begin - SECOND // 2, canvas.phases[0].span.end + SECOND // 2])
    assert np.isnan(references(trace, 1, after)).all()


@pytest.mark.long
def test_two_flights_are_drawn_over_each_other(trace, tmp_path):
    written = compare(([trace], [trace]), ("one", "other"), tmp_path)
    assert [path.name for path in written] == ["comparison.png", "paths.png"]
    assert sorted(path.suffix for path in tmp_path.iterdir()) == [".pdf", ".pdf", ".png", ".png"]


def test_a_moving_picture_shows_the_whole_flight_within_its_size(trace, tmp_path, monkeypatch):
    monkeypatch.setattr(animation, "FEWEST", 8)
    monkeypatch.setattr(animation, "RATE", 4)
    path = animate(trace, tmp_path / "flight.gif", 3.0)
    with Image.open(path) as picture:
        assert picture.n_frames == 12
        assert picture.info["duration"] * picture.n_frames == pytest.approx(3000, rel=0.05)
        first = np.asarray(picture.convert("RGB"), dtype=int)
        picture.seek(picture.n_frames - 1)
        last = np.asarray(picture.convert("RGB"), dtype=int)
    assert (np.abs(first - last).max(axis=2) > 60).mean() > 0.005  # drones and trails moved
    monkeypatch.setattr(animation, "LARGEST", 1000)
    with pytest.raises(ValueError, match="choose fewer seconds"):
        animate(trace, path, 3.0)
    assert not path.exists()


@pytest.mark.parametrize("view", VIEWS)
def test_a_moving_picture_has_the_view_the_size_and_the_names_that_are_wanted(trace, tmp_path, monkeypatch, view):
    named = []
    annotate = Axes.annotate
    monkeypatch.setattr(
        Axes, "annotate", lambda self, text, *a, **k: named.append(text) or annotate(self, text, *a, **k)
    )
    with Image.open(animate(trace, tmp_path / "a.gif", 2.0, view, 300)) as picture:
        assert picture.width == 300
        first = np.asarray(picture.convert("L")).astype(int)
        picture.seek(picture.n_frames // 2)
        moved = np.abs(np.asarray(picture.convert("L")).astype(int) - first) > 60
    assert named == ["leader", "uav1", "uav2", "uav3", "uav4"]
    assert moved.sum() > 100


def test_a_film_needs_ffmpeg_and_says_so(trace, tmp_path, monkeypatch):
    monkeypatch.setattr(animation, "which", lambda _: None)
    with pytest.raises(ValueError, match="an MP4 needs the program ffmpeg, which is not installed"):
        animate(trace, tmp_path / "flight.mp4", 2.0)


@pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="there is no ffmpeg")
def test_a_film_has_all_frames_and_shows_the_flight(trace, tmp_path):
    film = animate(trace, tmp_path / "flight.mp4", 2.0)
    still = ["ffmpeg", "-loglevel", "error", "-i", film, "-vsync", "0", tmp_path / "%03d.png"]
    subprocess.run(still, check=True)
    pictures = sorted(tmp_path.glob("*.png"))
    assert len(pictures) == 50
    first, last = (np.asarray(Image.open(path).convert("RGB"), dtype=int) for path in (pictures[0], pictures[-1]))
    assert (np.abs(first - last).max(axis=2) > 60).mean() > 0.005
    with pytest.raises(OSError, match="ffmpeg"):
        animate(trace, tmp_path / "missing" / "flight.mp4", 2.0)
