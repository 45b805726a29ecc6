"""What is in the figures: events that overlap nothing, one time axis, curves beside their references."""

import json
from dataclasses import replace

import numpy as np
import pytest
from flockwire.nanoseconds import BILLION
from flockwire_recorder.comparison import compare
from flockwire_recorder.drawing import NAME_ROWS, Canvas, rows_of
from flockwire_recorder.events import Event, events
from flockwire_recorder.motion import places, reference_velocities, references, velocities
from flockwire_recorder.reading import read_trace
from flockwire_recorder.trace import FAULTS


@pytest.fixture(scope="module")
def trace(good_flight):
    return read_trace(good_flight)


@pytest.fixture(scope="module")
def canvas(trace, tmp_path_factory):
    return Canvas(trace, tmp_path_factory.mktemp("figures"))


def test_names_of_events_that_are_close_stand_in_rows_of_their_own():
    marked = [Event(0, "takeoff"), Event(1, "start wide"), Event(2, "hold"), Event(90, "land")]
    assert rows_of(marked, [0.0, 0.01, 0.02, 0.9]) == [0, 1, 2, 0]


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
    phase = Canvas(trace, None).phase
    times = np.arange(phase.begin + 5 * BILLION, phase.begin + 7 * BILLION, BILLION // 10)
    assert np.abs(places(trace, 1, times) - references(trace, 1, times)).max() < 0.05
    assert np.abs(velocities(trace, 1, times) - reference_velocities(trace, 1, times)).max() < 0.1
    assert np.abs(velocities(trace, 1, times)).max() > 0.5


def test_hovering_and_landing_are_no_formation(trace, canvas):
    after = np.array([canvas.phase.begin - BILLION // 2, canvas.phase.end + BILLION // 2])
    assert np.isnan(references(trace, 1, after)).all()


def test_two_flights_are_drawn_over_each_other(trace, tmp_path):
    written = compare((trace, trace), ("one", "other"), tmp_path)
    assert [path.name for path in written] == ["comparison.png", "paths.png"]
    assert sorted(path.suffix for path in tmp_path.iterdir()) == [".pdf", ".pdf", ".png", ".png"]
