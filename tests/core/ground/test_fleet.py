from flockwire_core.domain.airframe import FlightState, Telemetry
from flockwire_core.domain.order import Mission
from flockwire_core.domain.time import SECOND
from flockwire_core.ground.fleet import STALE, Fleet
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.status import Report, Status
from repeated_orders import repeated

NOW = 1_790_000_000 * SECOND
PILOTS = {0: "leader", 3: "uav3"}
OLD = NOW - STALE
HOLD, LAND = Mission(NOW - 5, "world", "hold"), Mission(NOW - 2, "world", "land")


def status(identity, report, stamp=NOW):
    return Status(stamp, "world", identity, report, 0, 0, 0, 0, 0, 0.0, 0, (), ())


def telemetry(state, stamp=NOW):
    return Telemetry(stamp, "world", state, 1.0, 0.0, 0.0)


def fleet(statuses=(), states=None):
    return Fleet(PILOTS, {one.identity: one for one in statuses}, states or {}, NOW, repeated(statuses))


def test_who_is_silent_has_no_phase():
    known = fleet([status("leader", Report("hold")), status("uav3", Report("hold"), OLD)])
    assert [known.phase(drone) for drone in PILOTS] == ["hold", None]
    assert [known.why(drone) for drone in PILOTS] == ["hold", "silent"]
    assert not known.all_in(Phase.HOLD)
    assert fleet().why(3) == "no status"


def test_all_are_in_a_phase_when_each_is_in_one_of_those():
    known = fleet([status("leader", Report("hold")), status("uav3", Report("formation", "why"))])
    assert known.all_in(Phase.HOLD, Phase.FORMATION)
    assert not known.all_in(Phase.FORMATION)
    assert known.why(3) == "why"


def test_a_process_that_flies_nothing_is_not_a_pilot():
    known = fleet([status("gateway", Report("serving", mission=LAND))])
    assert known.mission() is None
    assert known.fresh == {}


def test_the_newest_order_that_somebody_obeys_is_the_fleets():
    assert fleet().mission() is None
    known = fleet([status("leader", Report("hold", mission=HOLD)), status("uav3", Report("landing", mission=LAND))])
    assert known.mission() == LAND


def test_only_who_obeys_this_very_order_has_confirmed_it():
    known = fleet([status("leader", Report("hold", mission=HOLD)), status("uav3", Report("landing", mission=LAND))])
    assert known.unconfirmed(HOLD) == ("uav3",)
    assert known.unconfirmed(LAND) == ("leader",)


def test_a_hold_below_a_landing_is_not_obeyed_in_the_air():
    lands = Report("landing", mission=LAND, concurrent=(HOLD.version,))
    on_ground = Report("ready", mission=LAND, concurrent=(HOLD.version,))
    assert fleet([status("leader", lands), status("uav3", on_ground)]).unconfirmed(HOLD) == ("leader",)


def test_two_landings_at_once_are_both_confirmed():
    other = Mission(NOW - 9, "world", "land", giver=3)
    lands = Report("landing", mission=LAND, concurrent=(other.version,))
    known = fleet([status("leader", lands), status("uav3", lands)])
    assert known.unconfirmed(other) == known.unconfirmed(LAND) == ()


def test_an_order_made_from_another_is_the_newer_one_whatever_their_stamps():
    start = Mission(NOW - 60 * SECOND, "world", "start", giver=4, knows=(LAND.version,))
    known = fleet([status("leader", Report("ready", mission=LAND)), status("uav3", Report("take-off", mission=start))])
    assert known.mission() == start
    assert known.overruled(LAND) == start
    assert known.overruled(start) is None


def test_who_is_silent_or_has_no_order_has_not_confirmed():
    known = fleet([status("leader", Report("ready")), status("uav3", Report("landing", mission=LAND), OLD)])
    assert known.unconfirmed(LAND) == ("leader", "uav3")


def test_a_gateway_that_repeats_another_order_gets_this_one_again_but_confirms_nothing():
    pilots = [status(identity, Report("landing", mission=LAND)) for identity in PILOTS.values()]
    for mission, lacks in ((None, True), (HOLD, True), (LAND, False)):
        known = fleet([*pilots, status("gateway", Report("tracking", mission=mission))])
        assert known.unconfirmed(LAND) == ()
        assert known.lacking(LAND) == (("gateway",) if lacks else ())
    silent = status("gateway", Report("tracking"), OLD)
    assert fleet(pilots).lacking(LAND) == fleet([*pilots, silent]).lacking(LAND) == ()
    assert fleet(pilots[:1]).lacking(LAND) == ("uav3",)


def test_a_drone_of_which_nothing_is_known_is_not_down():
    assert fleet().not_down() == ("uav0", "uav3")
    down = fleet(states={0: telemetry(FlightState.STOPPED), 3: telemetry(FlightState.GROUNDED)})
    assert down.not_down() == ()
    assert down.not_down(since=NOW - 1) == ()
    assert down.not_down(since=NOW) == ("uav0", "uav3")  # they may have taken off since
    old = fleet(states={0: telemetry(FlightState.LANDING), 3: telemetry(FlightState.GROUNDED, OLD)})
    assert old.not_down() == ("uav0", "uav3")


def test_a_hold_made_from_a_landing_does_not_hold_where_the_landing_does():
    hold = Mission(NOW, "world", "hold", giver=9, knows=(LAND.version,))
    known = fleet([status("leader", Report("landing", mission=LAND)), status("uav3", Report("hold", mission=hold))])
    assert known.mission() == LAND


def test_what_a_drone_that_was_left_out_brings_back_does_not_hold():
    start = Mission(NOW - 9, "world", "start", NOW - 9, giver=5, without=(3,))
    known = fleet([status("leader", Report("formation", mission=start)), status("uav3", Report("ready", mission=LAND))])
    assert known.mission() == known.flown() == start


def test_two_that_take_up_are_rivals_unless_one_was_made_from_the_other():
    start, other = Mission(NOW - 9, "world", "start", giver=5), Mission(NOW - 8, "world", "start", giver=6)
    known = fleet([status("leader", Report("formation", mission=other)), status("uav3", Report("hold", mission=start))])
    assert known.rival(start).mission == other
    assert known.rival(start._replace(stamp=NOW, knows=(other.version, start.version))) is None
    later = fleet([status("leader", Report("formation", mission=other._replace(knows=(start.version,))))])
    assert later.rival(start) is None
    assert fleet([status("leader", Report("landing", mission=LAND))]).rival(start) is None
