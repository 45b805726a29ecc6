from flockwire.flight.fleet import STALE, Fleet
from flockwire.flight.phases import Phase
from flockwire.nanoseconds import BILLION
from flockwire.wire.messages import FlightState, Mission, Telemetry
from flockwire.wire.status import Report, Status

NOW = 1_790_000_000 * BILLION
PILOTS = {0: "leader", 3: "uav3"}
OLD = NOW - STALE
HOLD, LAND = Mission(NOW - 5, "world", "hold"), Mission(NOW - 2, "world", "land")


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


def test_a_process_that_flies_nothing_is_nobodys_pilot():
    known = fleet([status("gateway", Report("serving", mission=LAND))])
    assert known.mission() is None
    assert known.fresh == {}


def test_the_newest_order_that_somebody_obeys_is_the_fleets():
    assert fleet().mission() is None
    known = fleet([status("leader", Report("hold", mission=HOLD)), status("uav3", Report("landing", mission=LAND))])
    assert known.mission() == LAND


def test_a_newer_order_confirms_an_older_one():
    known = fleet([status("leader", Report("hold", mission=HOLD)), status("uav3", Report("landing", mission=LAND))])
    assert known.unconfirmed(HOLD) == ()
    assert known.unconfirmed(LAND) == ("leader",)


def test_who_is_silent_or_has_no_order_has_not_confirmed():
    known = fleet([status("leader", Report("ready")), status("uav3", Report("landing", mission=LAND), OLD)])
    assert known.unconfirmed(LAND) == ("leader", "uav3")


def test_a_drone_of_which_nothing_is_known_is_not_down():
    assert fleet().not_down() == ("uav0", "uav3")
    down = fleet(states={0: telemetry(FlightState.STOPPED), 3: telemetry(FlightState.GROUNDED)})
    assert down.not_down() == ()
    assert down.not_down(since=NOW - 1) == ()
    assert down.not_down(since=NOW) == ("uav0", "uav3")  # they may have taken off since
    old = fleet(states={0: telemetry(FlightState.LANDING), 3: telemetry(FlightState.GROUNDED, OLD)})
    assert old.not_down() == ("uav0", "uav3")
