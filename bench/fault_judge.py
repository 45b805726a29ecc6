"""Flies one drawn flight in virtual time and judges it on the fly, by what is published: distances, falls, rungs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import combinations
from math import dist, hypot, inf
from typing import Any

from fault_draws import DURATION, SECOND_STATION, Drawn, drawn
from fault_rungs import told
from flockwire.domain.airframe import FlightState, Telemetry
from flockwire.domain.marks import marked
from flockwire.domain.order import Mission, Stop
from flockwire.domain.pose import Pose
from flockwire.domain.time import SECOND, nanoseconds
from flockwire.domain.vector import Vector
from flockwire.ground.order import Order
from flockwire.pilot.phases import IN_FLIGHT
from flockwire.swarm.model import uav
from flockwire.wire.phase import Phase
from flockwire.wire.processes import CONSOLE
from flockwire.wire.status import Status
from flockwire_sim.process import Published, VirtualProcess
from flockwire_sim.world import EPOCH, World
from flockwire_tello.simulated.served import ServedTello
from rare_draws import CLOCK, EARLY, HAND, ORDERS, STATION_KILLED

LONGEST = 75.0  # s that a flight may take: the operator waits up to 30 s for a stage
COLLISION = 0.2  # m between two centres, in the air
IN_THE_AIR = 0.15  # m
DOWN = 0.05  # m
HARD = 0.3  # m/s above `limits.vertical_speed` from which on a touch-down is too fast
FALL = SECOND  # ns: more than a fall from the fence's top takes
OBEYED = 3.0  # s in which an order has reached whoever can be reached
PAUSE = 0.1  # s without truth
AFTER = 2 * SECOND  # ns flown on after an order to a flight that is over
LANDING = 20  # s in which a landing after the flight must end
WORLD_ENDED = 2.0  # s from the end of the kinematics to that of the flight


@dataclass
class Result:
    """What became of one flight; distances in m, times in s after the order to take off."""

    seed: int
    variant: str
    usual: bool
    faults: list[dict[str, Any]]
    failure: str = ""
    seconds: float = 0.0
    closest: float = inf
    struck: float = inf  # between a drone that falls and another
    fastest_contact: float = 0.0  # m/s
    world_ended: bool = False
    bad: list[str] = field(default_factory=list)
    rungs: dict[str, float] = field(default_factory=dict)  # when each was first reached
    marks: dict[str, int] = field(default_factory=dict)  # how often each was reached

    @property
    def outcome(self) -> str:
        """Return the column of the table."""
        if self.bad:
            return "bad"
        if self.world_ended:
            return "world ended"
        if self.struck < COLLISION:
            return "struck by a fall"
        return "landed early" if self.failure else "flew on"


class Judge:
    """Judges one flight by what is published, and injects what the world does not."""

    def __init__(self, flight: Drawn, say: Callable[[str], None] | None = None) -> None:
        self.flight, self._say = flight, say
        self.result = Result(flight.seed, flight.variant, flight.usual, list(flight.faults))
        swarm = flight.swarm
        self._limits, self._stale = swarm.limits, swarm.limits.staleness
        kinds = {fault["kind"] for fault in flight.faults}
        stations = (CONSOLE.kind,) if {SECOND_STATION, ORDERS} & kinds else ()
        self.world = World(
            swarm, flight.seed, DURATION, flight.of_world(), self.take, flight.without, stations, flight.rare
        )
        self._ordered_down = inf  # when another station ordered a landing, after which it ordered no start
        plan = self.world.plan
        self._drivers = [self.world.processes[name] for name, row in plan.rows.items() if row.driver]
        self._pilots = {identity: uav(drone) for drone, identity in plan.pilots.items()}
        self._frame: dict[str, Vector] = {}
        self._at = self._before = 0
        self._last: dict[str, Vector] = {}  # the frame before
        self._speeds: dict[str, Vector] = {}  # between the two frames before
        self._took_off: int | None = None
        self._published: set[str] = set()  # verbs of orders
        self._stopped = False
        failures = [fault for fault in flight.faults if fault["kind"] == "failure"]
        self._fails = {uav(fault["drone"]): fault["at"] for fault in reversed(failures)}
        self._phases: dict[str, tuple[str, str]] = {}
        self._take = {"truth": self._truth, "status": self._status, "telemetry": self._telemetry,
                      "mission": self._mission, "stop": self._stop}  # fmt: skip

    def fly(self) -> Result:
        """Fly, judge the end too."""
        result, scheduler = self.result, self.world.scheduler
        scheduler.at(EPOCH + nanoseconds(LONGEST), lambda _: scheduler.stop())
        for fault in self.flight.faults:
            if fault["kind"] in (EARLY, HAND) or fault.get("on") == "":
                self._later(fault["at"], lambda fault=fault: self._inject(fault))
        with marked() as result.marks:
            outcome = self.world.run()
            if self.flight.after:
                self._order("operator", self.flight.after)
                scheduler.run(scheduler.now + AFTER)
            if any(fault["kind"] == ORDERS and fault["station"] == CONSOLE.kind for fault in self.flight.faults):
                self._land_again()
            if self._stopped:  # the flight is over when all motors are off: let the drones fall
                scheduler.run(scheduler.now + FALL)
        self._judge_frame()
        result.failure, result.seconds = outcome.failure, outcome.seconds
        if outcome.seconds >= LONGEST:
            result.bad.append(f"not over after {LONGEST:.0f} s")
        if not result.world_ended:
            high = [f"{owner} at {place[2]:.2f} m" for owner, place in self._frame.items() if place[2] > DOWN]
            result.bad += [f"ended with {', '.join(high)}"] if high else []
        return result

    def take(self, published: Published) -> None:
        """Receive what is published."""
        take = self._take.get(published.key.kind)
        if take is not None:
            opened = published.sample.opened()
            assert opened is not None
            take(published, opened[0])

    @property
    def _now(self) -> float:
        """The time in s after the order to take off."""
        return (self.world.scheduler.now - (self._took_off or EPOCH)) / SECOND

    def _mission(self, _: Published, message: Mission) -> None:
        if self._took_off is None:
            self._took_off = self.world.scheduler.now
            for fault in self.flight.faults:
                if fault["kind"] not in (EARLY, HAND, ORDERS):
                    self._later(fault["at"], lambda fault=fault: self._inject(fault))
        if message.verb not in self._published:
            self._published.add(message.verb)
            for fault in self.flight.faults:
                if fault.get("on") == message.verb:
                    self._later(fault["at"], lambda fault=fault: self._inject(fault))
        self._tell(f"order: {message.verb}")

    def _inject(self, fault: dict[str, Any]) -> None:
        processes, kind = self.world.processes, fault["kind"]
        self._tell(f"fault: {fault}")
        if kind == "stop":
            self.world.stop("bench")
        elif kind == SECOND_STATION:
            self._give(CONSOLE.kind, fault["orders"])
        elif kind == ORDERS:
            self._give(fault["station"], fault["orders"])
        elif kind == CLOCK:
            processes[CONSOLE.kind].clock.step(nanoseconds(fault["step"]))
        elif kind == EARLY:
            self._disturb(processes[fault["process"]], fault["duration"])
        elif kind == HAND:
            self._lift(fault["drone"], fault["duration"])
        elif kind == STATION_KILLED:
            processes["operator"].kill()
            self._end_when_down()
        elif kind == "told to end":
            processes[fault["process"]].retire()
        elif kind.startswith("station"):
            operator = processes["operator"]
            if kind == "station frozen":
                operator.freeze()
                self._later(fault["duration"], operator.thaw)
                return
            operator.kill()
            for process in [*self._drivers, *(processes[pilot] for pilot in self._pilots)]:
                process.retire()
            self._end_when_down()
        elif kind == "kill" and any(driver.identity == fault["process"] for driver in self._drivers):
            self.result.world_ended = True
            self._later(WORLD_ENDED, self.world.scheduler.stop)

    def _land_again(self) -> None:
        """Have the second station land what it has sent up since the flight was over."""
        scheduler, console = self.world.scheduler, self.world.station(CONSOLE.kind)
        if console.core.asked or any(place[2] > DOWN for place in self._frame.values()):
            self._order(CONSOLE.kind, "land")
            for _ in range(LANDING):
                scheduler.run(scheduler.now + SECOND)
                if not console.core.asked and all(place[2] <= DOWN for place in self._frame.values()):
                    return

    def _disturb(self, process: VirtualProcess, lasts: float) -> None:
        """Kill a process, or freeze it for some s."""
        if not lasts:
            process.kill()
            return
        process.freeze()
        self._later(lasts, process.thaw)

    def _lift(self, drone: int, lasts: float) -> None:
        """Hold a Tello in a hand for some s, before the flight."""
        served = self.world.processes["kinematics"]._core._airframes[uav(drone)]
        if isinstance(served, ServedTello) and self._took_off is None:
            airframe = served._tello.flight.airframe
            airframe.hold(1.0, served._now)
            self._later(lasts, lambda: airframe.hold(0.0, served._now))

    def _give(self, station: str, orders: list[tuple[Any, ...]]) -> None:
        """Have a station give these orders, one after another."""
        at = 0.0
        for after, *order in orders:
            at += after
            self._later(at, lambda order=order: self._order(station, *order))

    def _order(self, station: str, verb: str, formation: str = "", without: tuple[int, ...] = ()) -> None:
        """Have a station give an order; the operator gives it to the flight that it conducts."""
        self._tell(f"{station}: {verb} {formation} {without or ''}")
        virtual = self.world.station(station)
        if station == CONSOLE.kind:
            duration = 0.05 if formation == "hasty" else None
            virtual.ask(Order(verb, "wide" if duration else formation, duration, without))
        elif verb == "conduct":
            virtual.core.conduct(self.world.scheduler.now, DURATION)
        else:
            virtual.core.order(verb, self.world.scheduler.now)
        if verb in ("land", "start"):
            self._ordered_down = self._now if verb == "land" else inf

    def _end_when_down(self, looks: int = 0) -> None:
        """End the flight that has no operator any more once all have been down for a second, or the world is gone."""
        down = all(place[2] <= 0.0 for place in self._frame.values()) or not any(one.alive for one in self._drivers)
        looks = looks + 1 if down else 0
        if looks > 10:
            self.world.scheduler.stop()
        else:
            self._later(0.1, lambda: self._end_when_down(looks))

    def _later(self, seconds: float, action: Callable[[], None]) -> None:
        scheduler = self.world.scheduler
        scheduler.at(scheduler.now + nanoseconds(seconds), lambda _: action())

    def _stop(self, _: Published, __: Stop) -> None:
        self._stopped = True

    def _truth(self, published: Published, message: Pose) -> None:
        if published.at != self._at:
            self._judge_frame()
            self._before, self._at = self._at, published.at
            self._last = dict(self._frame)
        self._frame[published.key.owner] = message.position

    def _judge_frame(self) -> None:
        """Judge the positions of one moment."""
        if self._took_off is None:
            return
        result, now, frame = self.result, self._now, self._frame
        airborne = [(owner, place, self._falls(owner, now)) for owner, place in frame.items() if place[2] > IN_THE_AIR]
        for (one, a, falls), (other, b, drops) in combinations(airborne, 2):
            gap = dist(a, b)
            if falls or drops:
                result.struck = result.struck if falls and drops else min(result.struck, gap)
            elif gap < result.closest:
                if gap < COLLISION <= result.closest:
                    self._bad(f"collision of {one} and {other}")
                result.closest = gap
        dt = (self._at - self._before) / SECOND
        if dt > PAUSE:  # the world was frozen, or restarted
            self._last, self._speeds = {}, {}
            return
        for owner, place in frame.items():
            last = self._last.get(owner, place)
            if place[2] > 0.0:
                if self._limits.fence.room().outside(place) > 0.0:
                    self._reached("fence: inwards", now)
                x, y, z = (a - b for a, b in zip(place, last, strict=True))
                self._speeds[owner] = (x / dt, y / dt, z / dt)
            elif last[2] > 0.0 and not self._falls(owner, now):
                self._judge_contact(owner, self._speeds.get(owner, (0.0, 0.0, 0.0)))

    def _judge_contact(self, owner: str, velocity: Vector) -> None:
        """Judge how fast a drone came down."""
        speed = hypot(*velocity)
        self.result.fastest_contact = max(self.result.fastest_contact, speed)
        phase, _ = self._phases.get(owner, ("", ""))
        self._tell(f"{owner} touches down at {speed:.2f} m/s ({phase})")
        if speed > self._limits.vertical_speed + HARD:
            self._bad(f"{owner} touched down at {speed:.2f} m/s ({phase})")

    def _falls(self, owner: str, now: float) -> bool:
        falling = self._speeds.get(owner, (0.0, 0.0, 0.0))[2] < -2.0 * self._limits.vertical_speed
        return self._stopped or (owner in self._fails and (falling or now >= self._fails[owner]))

    def _status(self, published: Published, status: Status) -> None:
        owner, now = self._pilots.get(status.identity), self._now
        if owner is None:
            return
        report, stale = status.report, self._stale
        if self._phases.get(owner) != (report.phase, report.detail):
            self._phases[owner] = (report.phase, report.detail)
            self._tell(f"{status.identity}: {report.phase} {report.detail}")
            if report.phase == Phase.TAKEOFF and now > self._ordered_down + OBEYED:
                self._bad(f"{status.identity} takes off after a landing was ordered")
        if self._took_off is None:
            return
        for rung in told(report.phase, report.detail):
            self._reached(rung, now)
        if report.phase not in IN_FLIGHT:
            return
        if report.pose_age > stale.pose_zero:
            self._reached("own pose: zero", now)
        elif report.nearby_age > stale.nearby_slow:
            self._reached("nearby: slow", now)
        if report.estimate_age > stale.estimate_drop:
            self._reached("neighbour: dropped", now)
        if report.telemetry_age > stale.telemetry_warn:
            self._reached("telemetry: reported", now)

    def _telemetry(self, published: Published, message: Telemetry) -> None:
        age, stale = message.command_age, self._stale
        if message.state is FlightState.FLYING and age > stale.command_zero:
            self._reached("driver: zero", self._now)
        elif message.state is FlightState.LANDING and age > stale.command_land:
            self._reached("driver: land", self._now)

    def _reached(self, rung: str, now: float) -> None:
        self.result.rungs.setdefault(rung, round(now, 3))

    def _bad(self, what: str) -> None:
        self._tell(f"BAD: {what}")
        self.result.bad.append(f"{what} at {self._now:.2f} s")

    def _tell(self, what: str) -> None:
        if self._say is not None:
            self._say(f"{self._now:8.3f} s  {what}")


def fly(seed: int, say: Callable[[str], None] | None = None) -> Result:
    """Fly the flight of `seed`; `say` takes what happens, line by line."""
    return Judge(drawn(seed), say).fly()


def fly_rare(seed: int, say: Callable[[str], None] | None = None) -> Result:
    """Fly the flight of `seed` with what `--rare` adds."""
    return Judge(drawn(seed, rare=True), say).fly()
