"""A multirotor in flight: hover, limits, ground, wind, battery, faults; the row has what identification finds."""

from itertools import pairwise
from math import dist, hypot, pi

import pytest
from flockwire_core.domain.airframe import FlightState
from flockwire_core.domain.pose import yaw_of
from flockwire_core.domain.time import SECOND
from flockwire_core.swarm.airframes import MULTIROTOR
from flockwire_core.swarm.drones import BUILT_IN_AIRFRAMES, Airframe
from flockwire_operator.station.excitation import PULSES, STEP
from flockwire_operator.station.identification import StepResponse, fit_axis
from flockwire_twins.multirotor.airframe import CRASHED, TURNED_OVER, Multirotor
from flockwire_twins.multirotor.parameters import parameters_of
from flockwire_twins.multirotor.swarm_file import MODELS
from flockwire_twins.simulated_airframe import Wear
from flockwire_twins.wind import Wind

TICK = SECOND // 100
KINDS = [(name, rotors) for name in MODELS for rotors in (False, True) if rotors or "fitted" in MODELS[name]]
ROTORS = [("cf2x_L250", True), ("quad_1kg", True)]
every = pytest.mark.parametrize(("model", "rotors"), KINDS)
with_rotors = pytest.mark.parametrize(("model", "rotors"), ROTORS)


class Flight:
    """One multirotor, hovering at 2 m unless it stands."""

    def __init__(self, model="cf2x_L250", rotors=False, stands=False, **changed):
        airframe = Airframe(kind="multirotor", model=model, rotors=rotors)
        p = parameters_of(airframe).model_copy(update=changed)
        self.now, self.body = 0, Multirotor(airframe, p, (0.0, 0.0, 0.0), 0.4, 0, standing=True)
        if not stands:
            self.fly((0.0, 0.0, 1.0), 2.3)
            self.fly((0.0, 0.0, 0.0), 2.5)

    def accelerate(self, acceleration, seconds, is_sent=True):
        """Command a velocity that changes by `acceleration` along x; return its velocity and tilt at each tick."""
        found = []
        for k in range(round(100 * seconds)):
            change = (acceleration if is_sent else 0.0, 0.0, 0.0)
            self.body.command((acceleration * (k + 1) / 100.0, 0.0, 0.0), self.now, 0.0, change)
            self.now += TICK
            self.body.advance(self.now)
            found.append((self.body.velocity[0], hypot(*self.body.vehicle.up[:2])))
        return found

    def fly(self, velocity, seconds, yaw_rate=0.0):
        """Return position and velocity of each tick."""
        self.body.command(velocity, self.now, yaw_rate)
        found = []
        for _ in range(round(100 * seconds)):
            self.now += TICK
            self.body.advance(self.now)
            found.append((self.body.position, self.body.velocity))
        return found


@every
def test_it_takes_off_hovers_steadily_and_lands(model, rotors):
    flight = Flight(model, rotors)
    at = flight.body.position
    assert at[2] > 1.8
    hovered = flight.fly((0.0, 0.0, 0.0), 5.0)
    assert max(dist(place, at) for place, _ in hovered) < 1e-3
    assert max(hypot(*v) for _, v in hovered) < 1e-3
    assert yaw_of(flight.body.orientation) == pytest.approx(0.4, abs=1e-3)
    flight.fly((0.0, 0.0, -0.4), 8.0)
    assert (flight.body.state, flight.body.position[2]) == (FlightState.GROUNDED, 0.0)
    flight.fly((0.0, 0.0, 0.5), 2.0)
    assert flight.body.position[2] > 0.5


@every
def test_a_velocity_is_reached_without_overshoot_and_height_is_kept(model, rotors):
    flight = Flight(model, rotors)
    flown = flight.fly((1.0, 0.0, 0.0), 2.0)
    assert flown[-1][1] == pytest.approx((1.0, 0.0, 0.0), abs=0.01)
    assert max(v[0] for _, v in flown) < 1.02
    assert abs(flown[-1][0][2] - flown[0][0][2]) < 0.035


def test_a_heading_is_held_and_turned():
    flight = Flight()
    flight.fly((0.5, 0.5, 0.0), 2.0, yaw_rate=0.6)
    assert yaw_of(flight.body.orientation) == pytest.approx(0.4 + 1.2, abs=0.1)
    assert flight.body.velocity == pytest.approx((0.5, 0.5, 0.0), abs=0.01)


@pytest.mark.parametrize("rotors", [False, True])
def test_the_flight_does_not_depend_on_the_rate_of_calls(rotors):
    a, b = Flight(rotors=rotors), Flight(rotors=rotors)
    for flight, ticks in ((a, 1), (b, 7)):
        flight.body.command((0.7, -0.3, 0.2), flight.now)
        for k in range(ticks):
            flight.body.advance(flight.now + 77_777_777 * (k + 1) // ticks)
    assert (a.body.position, a.body.orientation) == (b.body.position, b.body.orientation)


@every
def test_the_row_has_what_identification_finds(model, rotors):
    flight, changes, track = Flight(model, rotors), [], []
    for seconds, sign in PULSES:
        changes.append((flight.now / SECOND, STEP * sign))
        begin = flight.now
        flown = flight.fly((STEP * sign, 0.0, 0.0), seconds)
        track += [((begin + (k + 1) * TICK) / SECOND, place[0]) for k, (place, _) in enumerate(flown)]
    fit, row = fit_axis(StepResponse(changes, track)), BUILT_IN_AIRFRAMES[MULTIROTOR.kind]
    near = 0.005 if (model, rotors) == (row.model, row.rotors) else 0.03
    lag, dead_time = (row.lag, row.dead_time) if model != "quad_1kg" else (0.14, 0.16)  # docs/multirotor.md
    assert fit.gain.value == pytest.approx(1.0, abs=0.01)
    assert fit.lag.value == pytest.approx(lag, abs=near)
    assert fit.dead_time.value == pytest.approx(dead_time, abs=near)
    assert fit.lag.value + fit.dead_time.value == pytest.approx(lag + dead_time, abs=0.016)


@every
def test_with_an_acceleration_beside_the_velocity_it_tilts_at_once(model, rotors):
    told, left = Flight(model, rotors), Flight(model, rotors)
    a, b = told.accelerate(1.0, 1.5), left.accelerate(1.0, 1.5, is_sent=False)
    assert a[14][1] > 1.5 * b[14][1] > 0.0
    late = told.body.vehicle.delays[0]
    assert 1.5 - a[-1][0] == pytest.approx(late, abs=0.07)
    assert 1.5 - b[-1][0] > 1.5 - a[-1][0] + 0.1


def wind(x, gust=0.0):
    return Wind((x, 0.0, 0.0), gust, lambda: 0.3)


@every
def test_wind_is_a_force_that_the_autopilot_leans_against(model, rotors):
    flight = Flight(model, rotors)
    flight.body.blow(wind(2.0))
    blown = flight.fly((0.0, 0.0, 0.0), 4.0)
    assert 0.01 < max(v[0] for _, v in blown) < 0.4
    assert blown[-1][1] == pytest.approx((0.0, 0.0, 0.0), abs=2e-3)
    across, _ = MODELS[model]["drag_kg_per_s"]
    x, y, z, w = flight.body.orientation
    lean = 2.0 * (x * z + w * y)  # x of the body's up
    assert lean == pytest.approx(-2.0 * across / MODELS[model]["mass_kg"] / 9.81, rel=0.1)


@pytest.mark.parametrize("rotors", [False, True])
def test_tilt_and_thrust_are_bounded_and_counted(rotors):
    flight = Flight(rotors=rotors)
    vehicle = flight.body.vehicle
    before = vehicle.tilt_limited
    flight.fly((6.0, 0.0, 0.0), 0.5)
    assert vehicle.tilt_limited > before
    up = flight.body.vehicle.up[2]
    assert up > 0.7
    before = vehicle.thrust_limited
    climbed = flight.fly((0.0, 0.0, 8.0), 0.5)
    assert vehicle.thrust_limited > before
    assert flight.body.vehicle.thrust <= 1.0 + 1e-6
    assert max((b[1][2] - a[1][2]) * 100 for a, b in pairwise(climbed)) < 6.0


@every
def test_who_climbs_by_all_its_thrust_still_turns_aside(model, rotors):
    flight = Flight(model, rotors)
    flight.fly((1.5, 0.0, -1.0), 0.8)
    flight.fly((-1.5, 0.0, 5.0), 1.0)
    assert "limit of thrust" in flight.body.remark
    assert flight.body.velocity[0] < -1.0


def test_a_battery_that_sags_limits_the_climb_and_empties_by_power():
    full, weak = Flight(), Flight(sag_empty=0.15)
    assert 0.98 < full.body.battery < 1.0
    climbs = []
    for flight in (full, weak):
        flight.body.battery = 0.05
        climbs.append(flight.fly((0.0, 0.0, 6.0), 1.0)[-1][1][2])
    assert climbs[1] < 0.9 * climbs[0]


def test_the_ground_lifts_a_low_drone():
    low = [Flight(stands=True, ground_effect_radius_m=radius) for radius in (0.0, 0.1)]
    heights = [flight.fly((0.0, 0.0, 0.2), 0.3)[-1][0][2] for flight in low]
    assert heights[1] > heights[0] + 1e-4


@pytest.mark.parametrize("rotors", [False, True])
@pytest.mark.parametrize("wrong", [{"mass": 1.15}, {"gains": 0.6}])
def test_with_a_wrong_mass_or_gains_it_still_hovers(rotors, wrong):
    flight = Flight(rotors=rotors)
    flight.body.wear(Wear(**wrong))
    flight.fly((0.0, 0.0, 0.0), 5.0)
    before = flight.body.position
    assert max(dist(place, before) for place, _ in flight.fly((0.0, 0.0, 0.0), 2.0)) < 0.005


@with_rotors
def test_a_weak_motor_is_compensated(model, rotors):
    flight = Flight(model, rotors)
    flight.body.wear(Wear(rotors=(1.0, 0.9, 1.0, 1.0)))
    before = flight.body.position
    assert max(dist(place, before) for place, _ in flight.fly((0.0, 0.0, 0.0), 3.0)) < 0.3
    assert flight.body.velocity == pytest.approx((0.0, 0.0, 0.0), abs=0.03)
    assert not flight.body.failure


@with_rotors
def test_with_a_lost_rotor_it_falls_and_says_so(model, rotors):
    flight = Flight(model, rotors)
    flight.body.wear(Wear(rotors=(1.0, 0.0, 1.0, 1.0)))
    flight.fly((0.0, 0.0, 0.0), 3.0)
    assert flight.body.failure == {"cf2x_L250": TURNED_OVER, "quad_1kg": CRASHED}[model]
    assert (flight.body.state, flight.body.position[2]) == (FlightState.STOPPED, 0.0)
    assert not flight.body.falling


@every
def test_without_motors_it_falls(model, rotors):
    flight = Flight(model, rotors)
    flight.body.stop()
    fallen = flight.fly((0.0, 0.0, 1.0), 0.6)
    assert fallen[-1][1][2] < -2.0
    flight.fly((0.0, 0.0, 1.0), 2.0)
    assert (flight.body.position[2], flight.body.velocity) == (0.0, (0.0, 0.0, 0.0))


def test_a_pause_leaves_it_where_it_is():
    flight = Flight()
    before = flight.fly((0.0, 0.0, 0.0), 0.5)[-1][0]
    flight.body.skip(5 * SECOND)
    flight.now += 5 * SECOND
    assert dist(flight.fly((0.0, 0.0, 0.0), 0.1)[-1][0], before) < 1e-3


def test_a_lag_and_a_dead_time_of_a_fault_delay_its_commands():
    flight, slow = Flight(), Flight()
    slow.body.respond(0.3, 0.2)
    gone = [each.fly((1.0, 0.0, 0.0), 3.0)[-1][0][0] for each in (flight, slow)]
    assert gone[0] - gone[1] == pytest.approx(0.5, abs=0.01)


def test_its_tilt_is_seen():
    flight = Flight()
    flight.fly((2.0, 0.0, 0.0), 0.2)
    x, y, _, _ = flight.body.orientation
    assert 0.1 < 2.0 * hypot(x, y) < pi / 4
