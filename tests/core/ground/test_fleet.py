from flockwire_core.domain.airframe import FlightState, Telemetry
from flockwire_core.domain.order import Mission
from flockwire_core.domain.time import SECOND
from flockwire_core.ground.fleet import STALE, Fleet
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.status import Report, Status

NOW = 1_790_000_000 * SECOND
PILOTS = {0: "leader", 3: "uav3"}
OLD = NOW - STALE
HOLD, LAND = Mission(NOW - 5, "world", "hold", number=1), Mission(NOW - 2, "world", "land", number=2)


def status(identity, report, stamp=NOW):
    return Status(stamp, "world", identity, report, 0, 0, 0, 0, 0, 0.0, 0, (), ())


def telemetry(state, stamp=NOW):
    return Telemetry(stamp, "world", state, 1.0, 0.0, 0.0)


def fleet(statuses=(), states=None):
    return Fleet(PILOTS, {one.identity: one for one in statuses}, states or {}, NOW)


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


def gateway(mission, age=1.0, stamp=NOW):
    return status("gateway", Report("tracking", mission=mission, order_age=age), stamp)


def test_the_order_in_force_is_the_gateways():
    assert (fleet().mission(), fleet().order_age, fleet([gateway(None, -1.0)]).mission()) == (None, None, None)
    known = fleet([gateway(LAND), status("leader", Report("hold", mission=HOLD))])
    assert (known.mission(), known.order_age) == (LAND, 1.0)
    assert known.fresh.keys() == {0}
    assert fleet([gateway(LAND, stamp=OLD)]).mission() is None


def test_what_a_pilot_obeys_and_the_log_does_not_have_is_unclear():
    unnumbered = Report("landing", mission=LAND._replace(number=0), unnumbered=(LAND.version,))
    known = [status("leader", Report("hold", mission=HOLD)), status("uav3", unnumbered)]
    assert fleet([*known, gateway(HOLD)]).unclear() == [3]
    assert fleet([*known, gateway(LAND._replace(downs=(LAND.version,)))]).unclear() == []
    assert fleet([*known, gateway(None)]).unclear() == [0, 3]
    assert fleet(known).unnumbered(PILOTS.values()) == ("uav3",)


def test_only_who_obeys_this_very_order_has_confirmed_it():
    known = fleet([status("leader", Report("hold", mission=HOLD)), status("uav3", Report("landing", mission=LAND))])
    assert known.unconfirmed(HOLD) == ("uav3",)
    assert known.unconfirmed(LAND) == ("leader",)


def test_a_hold_below_a_landing_is_not_obeyed_in_the_air():
    lands = Report("landing", mission=LAND, unnumbered=(HOLD.version,))
    on_ground = Report("ready", mission=LAND, unnumbered=(HOLD.version,))
    assert fleet([status("leader", lands), status("uav3", on_ground)]).unconfirmed(HOLD) == ("leader",)


def test_two_landings_at_once_are_both_confirmed():
    other = Mission(NOW - 9, "world", "land", giver=3)
    lands = Report("landing", mission=LAND._replace(downs=(other.version, LAND.version)))
    known = fleet([status("leader", lands), status("uav3", lands)])
    assert known.unconfirmed(other) == known.unconfirmed(LAND) == ()


def test_stronger_is_what_outranks_an_order_or_was_made_from_it():
    start = Mission(NOW, "world", "start", giver=4, number=3, downs=(LAND.version,))
    assert fleet([gateway(start)]).stronger(LAND) == start
    assert fleet([gateway(LAND)]).stronger(HOLD._replace(number=0)) == LAND
    assert fleet([gateway(HOLD)]).stronger(LAND) is None
    proposal = start._replace(number=2, downs=())
    assert fleet([gateway(LAND)]).stronger(proposal) is None  # it was made from that
    assert fleet([gateway(LAND._replace(number=3))]).stronger(proposal).verb == "land"


def test_who_is_silent_or_has_no_order_has_not_confirmed():
    known = fleet([status("leader", Report("ready")), status("uav3", Report("landing", mission=LAND), OLD)])
    assert known.unconfirmed(LAND) == ("leader", "uav3")


def test_a_gateway_that_repeats_another_order_gets_this_one_again_but_confirms_nothing():
    pilots = [status(identity, Report("landing", mission=LAND)) for identity in PILOTS.values()]
    for mission, lacks in ((None, True), (HOLD, True), (LAND, False)):
        known = fleet([*pilots, gateway(mission)])
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


def test_a_formation_is_flown_by_the_order_in_force():
    start = Mission(NOW - 9, "world", "start", NOW - 9, giver=5, number=1)
    flies = status("leader", Report("formation", mission=start))
    assert fleet([flies, gateway(start)]).flown() == start
    assert fleet([flies, gateway(LAND)]).flown() is None
    assert fleet([status("leader", Report("hold", mission=start)), gateway(start)]).flown() is None
