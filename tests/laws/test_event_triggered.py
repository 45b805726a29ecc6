import numpy as np
import pytest
from flockwire_core.law import Heard, Observation, Sense
from flockwire_laws.event_triggered import EventTriggered, Sent, StateTriggered
from law_flights import Flight, both, graph, place, settings, sight

PATH = both([(1, 2), (2, 3), (3, 4), (4, 5), (5, 6)])
PLACES = {i: (float(i), 0.5 * i, 0.0) for i in range(1, 7)}
START = {i: np.array(PLACES[i]) + p for i, p in enumerate(np.random.default_rng(13).normal(size=(6, 3)), 1)}
H = np.array(list(PLACES.values()))


def test_command_and_event_are_the_equations():
    draw = np.random.default_rng(14)
    law, site = EventTriggered(settings(c0=0.1, c1=0.2, alpha=0.5)), place(PLACES, 2, (1, 3))
    p, x = draw.normal(size=3), draw.normal(size=(2, 3))
    heard = [Heard(j, w, False, 0, 1, Sent(tuple(one))) for j, w, one in zip((1, 3), (0.5, 2.0), x, strict=True)]
    first = law.step(Observation(t=0.0, position=tuple(p), place=site, heard=heard))
    q = p - PLACES[2]
    assert first.message.x == pytest.approx(q)
    assert first.command == pytest.approx(-0.5 * (q - x[0]) - 2.0 * (q - x[1]), abs=1e-5)
    limit = 0.1 + 0.2 * np.exp(-0.5)
    near = law.step(Observation(t=1.0, position=tuple(np.add(p, (limit - 1e-6, 0, 0))), place=site, heard=heard))
    assert (near.message, near.command) == (None, pytest.approx(first.command))
    assert (
        law.step(Observation(t=1.0, position=tuple(np.add(p, (limit + 1e-6, 0, 0))), place=site, heard=heard)).message
        is not None
    )


def test_state_trigger_is_the_equation_with_the_best_a():
    law, site = StateTriggered(settings(sigma=0.55)), place(PLACES, 2, (1, 3))
    p, others = np.array([0.3, 0.2, 0.0]), {1: np.array([1.0, 0.0, 0.0]), 3: np.array([-0.5, 2.0, 0.0])}
    seen = lambda x: [sight(Sense.POSITION, j, 1.0, False, o - x, np.zeros(3)) for j, o in others.items()]  # noqa: E731
    law.step(Observation(position=tuple(p), place=site, neighbours=seen(p)))
    z = lambda x: sum((x - PLACES[2]) - (o - PLACES[j]) for j, o in others.items())  # noqa: E731
    a, n = 1 / 4, 2.0
    for e in np.linspace(0.01, 2.0, 60):
        x = np.add(p, (e, 0.0, 0.0))
        event = e**2 > 0.55 * a * (1 - a * n) / n * (z(x) @ z(x))
        again = StateTriggered(settings(sigma=0.55))
        again.step(Observation(position=tuple(p), place=site, neighbours=seen(p)))
        assert (again.step(Observation(position=tuple(x), place=site, neighbours=seen(x))).message is not None) == event


@pytest.mark.parametrize("lag", [0.0, 0.1])
@pytest.mark.parametrize(("law", "share"), [(EventTriggered, 0.04), (StateTriggered, 0.15)])
def test_average_is_kept_with_few_messages_and_the_bound_holds(law, share, lag):
    parameters = {"c0": 0.005, "c1": 0.3, "alpha": 0.2}
    flight = Flight(law, START, PATH, PLACES, parameters=parameters, lag=lag)
    flight.step()  # the first messages are under way
    flown = flight.fly(30.0, lambda one: one.array - H)
    assert np.abs(flown.mean(axis=1) - flown[0].mean(axis=0)).max() < 1e-3
    laplacian = np.diag([1, 2, 2, 2, 2, 1]) - np.eye(6, k=1) - np.eye(6, k=-1)
    bound = np.linalg.norm(laplacian, 2) * np.sqrt(6) * 0.005 / np.linalg.eigvalsh(laplacian)[1]
    assert np.linalg.norm(flown[-1] - flown[-1].mean(axis=0)) < (bound if law is EventTriggered else 0.01)
    assert flight.messages < share * 6 * 3000
    assert not law.check(flight.graph, {}, parameters)[0]


def test_check_refuses_a_directed_graph_and_a_fast_threshold():
    assert EventTriggered.check(graph(PLACES, PATH[:-1]), {}, {})[0]
    assert "lambda_2" in EventTriggered.check(graph(PLACES, PATH), {}, {"alpha": 0.3})[0][0]
