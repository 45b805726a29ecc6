"""What an airframe is like, from its response: the fit alone, and flights of a simulated Tello under its driver."""

from __future__ import annotations

import tomllib
from math import cos, sin
from random import Random

import numpy as np
import pytest
from flockwire_core.control.airframe.first_order_lag import lagged
from flockwire_core.domain.body import Nearby
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.wire.keys import Key
from flockwire_operator.station.excitation import MOST_INTERRUPTIONS, Axis, ExcitationCore, ExcitationStage
from flockwire_operator.station.identification import IdentificationError, Interval, StepResponse, combined, fit_axis
from flockwire_operator.station.identify import airframe_table, described, draw
from flockwire_tello.driver import DriverCore
from flockwire_tello.swarm_file import COMMAND_PORT, StickGains, tello_addresses
from flockwire_twins.tello.parameters import TelloParameters
from flockwire_twins.tello.tello import SimulatedTello

BEGAN = 1_790_000_000 * SECOND
TELLO = {"drones.1.airframe": "tello", "limits.speed": 1.0}
TRUTHS = ("gain", "lag", "dead_time")


def response(gain=0.9, lag=0.25, dead_time=0.12, noise=0.001, seed=1):
    """Return the response of an exact airframe, tracked with noise."""
    chance, changes = Random(seed), [(0.31 + 0.7 * k, 0.3 * (-1) ** k) for k in range(12)]
    x = v = u = 0.0
    track, due = [], [(t + dead_time, value) for t, value in changes]
    for k in range(9000):  # ms
        while due and due[0][0] <= k / 1000.0:
            u = gain * due.pop(0)[1]
        x, v = lagged(x, v, u, lag, 0.001)
        if k % 10 == 9:
            track.append(((k + 1) / 1000.0, x + chance.gauss(0.0, noise)))
    return StepResponse(tuple(changes), tuple(track))


def test_without_noise_the_fit_is_exact():
    fit = fit_axis(response(noise=0.0))
    assert [fit.gain.value, fit.lag.value, fit.dead_time.value] == pytest.approx([0.9, 0.25, 0.12], abs=1e-3)
    assert fit.residual < 1e-4


def test_intervals_hold_the_truth_as_often_as_they_claim_and_shrink_with_the_noise():
    hits = []
    for seed in range(40):
        fit = fit_axis(response(seed=seed))
        known = ((fit.gain, 0.9), (fit.lag, 0.25), (fit.dead_time, 0.12))
        hits += [interval.low <= truth <= interval.high for interval, truth in known]
    assert sum(hits) >= 0.9 * len(hits)
    assert not all(truth in fit_axis(response(noise=1e-5)).gain for truth in (0.89, 0.91))
    quiet, loud = (fit_axis(response(noise=noise)).gain for noise in (0.0005, 0.005))
    assert loud.high - loud.low > 5.0 * (quiet.high - quiet.low)


def test_what_does_not_tell_is_refused():
    with pytest.raises(IdentificationError, match="too few"):
        fit_axis(StepResponse(((0.0, 0.3),), tuple((0.01 * k, 0.0) for k in range(500))))
    turned = response(gain=-0.5)
    with pytest.raises(IdentificationError, match="is that the drone's own body"):
        fit_axis(turned)


def test_several_fits_are_combined_by_how_well_they_are_known():
    assert combined([Interval(1.0, 0.9, 1.1), Interval(2.0, 1.0, 3.0)]) == pytest.approx(1.0, abs=0.02)


def flown(swarm, seed: int, noise: float = 0.001, blind: tuple[float, float] = (0.0, 0.0), swapped: bool = False):
    """Fly a Tello of drawn parameters with the excitation as its pilot; return its truths and the core.

    The tracker sees nothing in `blind`, s; `swapped`, it has another's body, which stands, under the drone's name.
    """
    chance = Random(seed)
    truth = (chance.uniform(0.7, 1.3), chance.uniform(0.15, 0.35), chance.uniform(0.05, 0.2))
    parameters = TelloParameters(
        position=swarm.drone(1).start, yaw=chance.uniform(-3.0, 3.0), lag=truth[1], yaw_lag=truth[1],
        gains=StickGains(**{stick: truth[0] * gain for stick, gain in StickGains()}), dead_time=truth[2],
    )  # fmt: skip
    now = BEGAN
    tello, driver = SimulatedTello(parameters, 0, chance.random), DriverCore(swarm, 1, now)
    core = ExcitationCore(swarm, 1, now)

    def flush() -> None:
        for datagram in driver.outgoing(now):
            tello.receive(datagram.data, datagram.source, now - BEGAN)

    address = tello_addresses(swarm, 1).drone
    while core.stage is not ExcitationStage.DONE and now - BEGAN < 200 * SECOND:
        now += SECOND // 100
        for data, target in tello.outgoing(now - BEGAN):
            driver.datagram(data, (address, COMMAND_PORT), target, now)
            flush()
        if not blind[0] <= (now - BEGAN) / SECOND < blind[1]:
            motion = tello.flight.airframe.motion(now - BEGAN)
            half = (motion.yaw + chance.gauss(0.0, 2.0 * noise)) / 2.0
            if swapped:
                motion = motion._replace(position=parameters.position)
            seen = tuple(x + chance.gauss(0.0, noise) for x in motion.position)
            pose = Pose(now, "w", seen, (0.0, 0.0, sin(half), cos(half)))
            for key, message in ((Key("nearby", "uav1"), Nearby(now, "w", ())), (Key("pose", "uav1"), pose)):
                core.receive(key, message, now)
                driver.receive(key, message, now)
        for key, message in core.step(now):
            driver.receive(key, message, now)
            flush()
        if now // (SECOND // 100) % 2:
            for key, message in driver.step(now):
                core.receive(key, message, now)
            flush()
    return truth, core, tello.flight.airframe.motion(now - BEGAN)


def test_a_simulated_tello_is_identified_in_flight(make_swarm, tmp_path):
    swarm = make_swarm(TELLO)
    truth, core, motion = flown(swarm, 0)
    assert core.failure == ""
    assert motion.position[2] == 0.0
    fits = {axis: fit_axis(found) for axis, found in core.responses.items()}
    assert list(fits) == list(Axis)
    for fit in fits.values():
        assert fit.gain.value == pytest.approx(truth[0], rel=0.03)
        assert [fit.lag.value, fit.dead_time.value] == pytest.approx(truth[1:], abs=0.015)
    table = "\n".join(airframe_table(swarm, 1, fits))
    again = make_swarm(TELLO | {"airframes": tomllib.loads(table)["airframes"]}).airframe(1)
    assert again.stick_gains.right == pytest.approx(0.01 * truth[0], rel=0.03)
    assert (again.kind, again.lag) == ("tello", pytest.approx(truth[1], abs=0.015))
    assert len(list(described(fits))) == 2 + len(fits)
    draw(core.responses, fits, tmp_path / "figure.png")
    assert (tmp_path / "figure.png").stat().st_size > 10_000


def test_an_axis_restarts_when_the_pose_was_lost_for_a_moment(make_swarm):
    swarm = make_swarm(TELLO)
    truth, core, _ = flown(swarm, 0, blind=(13.0, 13.4))
    assert core.failure == ""
    assert fit_axis(core.responses[Axis.FORWARD]).gain.value == pytest.approx(truth[0], rel=0.03)
    assert MOST_INTERRUPTIONS > 1


def test_a_pose_that_stays_away_lands_it_and_is_the_reason(make_swarm):
    _, core, motion = flown(make_swarm(TELLO), 0, blind=(13.0, 60.0))
    assert "own pose" in core.failure
    assert motion.position[2] == 0.0
    assert not core.responses


def test_a_drone_that_rises_while_its_body_does_not_lands_and_reports_why(make_swarm):
    _, core, motion = flown(make_swarm(TELLO), 0, swapped=True)
    assert "does the body belong to another drone" in core.failure
    assert motion.position[2] == 0.0


@pytest.mark.long
def test_fifty_simulated_tellos_are_identified_within_what_is_claimed(make_swarm):
    swarm = make_swarm(TELLO)
    hits: dict[tuple[Axis, str], list[bool]] = {}
    for seed in range(50):
        truth, core, _ = flown(swarm, seed)
        assert core.failure == ""
        for axis, found in core.responses.items():
            fit = fit_axis(found)
            assert fit.gain.value == pytest.approx(truth[0], rel=0.03), seed
            assert [fit.lag.value, fit.dead_time.value] == pytest.approx(truth[1:], abs=0.015), seed
            for name, value in zip(TRUTHS, truth, strict=True):
                interval = getattr(fit, name)
                hits.setdefault((axis, name), []).append(interval.low <= value <= interval.high)
    assert {key: np.mean(found) for key, found in hits.items() if np.mean(found) < 0.9} == {}
