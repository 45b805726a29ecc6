"""Faults in virtual time: short flights of the paper's swarm of five, each with one to three faults drawn by its seed.

    .compiled/bin/python bench/fault_flights.py [--flights 5000] [--jobs 1] [--out runs/fault_flights] [--resume]
    .compiled/bin/python bench/fault_flights.py --seed N          (flies one again, and prints what happened)

Drawn are the law, the airframe, for most of the flights other limits, and kinds, places and moments of the faults.
A tap judges on the fly, by the true positions; there is no trace. A collision is two drones in the air (above 0.15 m)
closer than 0.2 m. Counted separately: what a falling drone strikes (failed, or stopped), which nobody can avoid. When
the kinematics are killed the simulated world has ended, drones and all, and the flight is judged up to there;
restarted, the world begins again with all drones on the ground.
"""

from __future__ import annotations

import argparse
import json
import sys
import tomllib
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict, dataclass, field
from itertools import combinations, permutations
from math import dist, hypot, inf
from multiprocessing import Pool
from pathlib import Path
from random import Random
from statistics import median
from typing import Any

from flockwire.control.vector import Vector
from flockwire.flight.faults import Fault, parse_faults
from flockwire.flight.phases import IN_FLIGHT, SHUTDOWN, Phase
from flockwire.loading import parse_swarm
from flockwire.nanoseconds import BILLION
from flockwire.swarm.model import Swarm, uav
from flockwire.wire.messages import FlightState, Mission, Pose, Stop, Telemetry
from flockwire.wire.plan import Plan
from flockwire.wire.status import Status
from flockwire_sim.process import Published
from flockwire_sim.study.file import Starts
from flockwire_sim.study.places import random_starts
from flockwire_sim.world import EPOCH, World

SWARMS = Path(__file__).parents[1] / "swarms"
VARIANTS = {  # swarm file, law, starts drawn, share of the flights
    "extended": ("paper_simulation", "extended", True, 0.55),
    "extended, Tello": ("paper_flight", "extended", False, 0.2),
    "paper": ("paper_simulation", "paper", False, 0.15),
    "paper, Tello": ("paper_flight", "paper", False, 0.1),
}
DURATION = 8.0  # s from the order to take off to the order to land
LONGEST = 75.0  # s that a flight may take: the operator waits up to 30 s for a stage
COLLISION = 0.2  # m between two centres, in the air
IN_THE_AIR = 0.15  # m
DOWN = 0.05  # m
HARD = 0.3  # m/s above `limits.vertical_speed` from which on a touch-down is too fast
FALL = BILLION  # ns: more than a fall from the fence's top takes
PAUSE = 0.1  # s without truth
WORLD_ENDED = 2.0  # s from the end of the kinematics to that of the flight
FILE_KINDS = ("kill", "restart", "freeze", "cut", "partition", "link", "tracker", "noise", "clock", "lag", "failure")
KINDS = (*FILE_KINDS, "stop", "told to end", "station frozen", "station lost")

REASONS = {  # how the reason of a pilot begins: rung
    "own pose is stale": "own pose: hold",
    "own pose lost": "own pose: land",
    "no news of the leader": "news of the leader: hold",
    "news of the leader lost": "news of the leader: land",
    "the leader is down": "leader down: hold",
    "the leader lost": "leader down: land",
    "nearby bodies are stale": "nearby: hold",
    "telemetry lost": "telemetry: land",
    "emergency stop": "stop",
}
RUNGS = (
    "own pose: zero", "own pose: hold", "own pose: land", "neighbour: dropped", "news of the leader: hold",
    "news of the leader: land", "leader down: hold", "leader down: land", "nearby: slow", "nearby: hold",
    "telemetry: reported", "telemetry: land", "battery: refuses", "battery: land", "fence: inwards", "fence: land",
    "stop", "told to end: hold", "told to end: land", "driver: zero", "driver: land",
)  # fmt: skip


@dataclass(frozen=True)
class Drawn:
    """One flight as its seed has it: `faults` in order, those of FILE_KINDS for the world, the others for the tap."""

    seed: int
    variant: str
    swarm: Swarm
    faults: tuple[dict[str, Any], ...]
    usual: bool  # the limits are those of the swarm file

    def of_world(self) -> tuple[Fault, ...]:
        """Return the faults that the simulated world injects."""
        listed = [fault for fault in self.faults if fault["kind"] in FILE_KINDS]
        return parse_faults({"faults": listed}, Plan(self.swarm), f"seed {self.seed}")


def drawn(seed: int) -> Drawn:
    """Draw the flight of `seed`."""
    chance = Random(f"fault flight {seed}")
    variant = chance.choices(tuple(VARIANTS), [share for *_, share in VARIANTS.values()])[0]
    file, law, moved, _ = VARIANTS[variant]
    table = tomllib.loads((SWARMS / f"{file}.toml").read_text())
    table["control"]["law"] = law
    usual = chance.random() < 0.4
    if not usual:
        table["limits"]["staleness"] = _staleness(chance)
    if chance.random() < 0.08:
        table.setdefault("airframes", {}).setdefault("kinematics", {})["endurance"] = chance.uniform(5.0, 12.0)
    if chance.random() < 0.25:
        _tighten_fence(table, file, chance)
    if moved:
        places = random_starts(parse_swarm(table, file), Starts(box=(6.0, 6.0), fixed=(0,)), chance)
        for drone, (x, y) in zip(table["drones"], places, strict=True):
            drone["start"] = [x, y, 0.0]
    swarm = parse_swarm(table, file)
    plan = Plan(swarm)
    kinds = chance.choices((*KINDS, "cut"), k=chance.choice((1, 1, 2, 2, 3)))
    faults = (_fault(kind, plan, chance) for kind in kinds)
    return Drawn(seed, variant, swarm, tuple(sorted(faults, key=lambda fault: fault["at"])), usual)


def _staleness(chance: Random) -> dict[str, float]:
    pose, estimate, command = chance.uniform(0.1, 0.4), chance.uniform(0.5, 1.5), chance.uniform(0.1, 0.4)
    telemetry = chance.uniform(0.3, 1.0)
    return {
        "pose_zero": pose,
        "pose_land": pose + chance.uniform(0.2, 1.0),
        "estimate_drop": chance.uniform(0.15, 0.5),
        "estimates_hold": estimate,
        "estimates_land": estimate + chance.uniform(0.5, 4.0),
        "leader_silent": chance.uniform(0.3, 1.0),
        "leader_land": chance.uniform(0.2, 2.0),
        "nearby_slow": 0.1,
        "nearby_hold": chance.uniform(0.15, 0.5),
        "command_zero": command,
        "command_land": command + chance.uniform(0.2, 1.0),
        "telemetry_warn": telemetry,
        "telemetry_land": telemetry + chance.uniform(0.2, 1.0),
    }


def _tighten_fence(table: dict[str, Any], file: str, chance: Random) -> None:
    """Let the formation reach the fence, or the climb its top."""
    reach, low = (3.05 if file == "paper_simulation" else 1.8), chance.random() < 0.5
    table["limits"]["fence"] = {"min": [-reach, -reach, -0.5], "max": [reach, reach, 0.93 if low else 3.0]}
    table["limits"]["fence"]["margin"] = chance.uniform(0.02, 0.1)
    table["limits"]["takeoff_height"] = 0.9 if low else 1.0
    table["leader"] |= {"trajectory": {"kind": "constant", "velocity": [0.3, 0.2, 0.0]}, "input_bound": 0.4}
    table.pop("obstacles", None)


def _fault(kind: str, plan: Plan, chance: Random) -> dict[str, Any]:
    """Draw one fault of `kind`, keys as in a file of faults."""
    lasting = round(min(8.0, 0.3 * (8.0 / 0.3) ** chance.random()), 3)  # s, as often short as long
    fault: dict[str, Any] = {"at": round(chance.uniform(0.0, DURATION + 1.0), 3), "kind": kind}
    if kind in ("freeze", "cut", "partition", "link", "tracker", "noise", "station frozen"):
        fault["duration"] = round(chance.uniform(0.3, 8.0), 3) if kind == "cut" else lasting
    if kind in ("tracker", "lag", "failure"):
        fault["drone"] = chance.choice(plan.swarm.flying)
    return fault | _keys(kind, plan, chance)


def _keys(kind: str, plan: Plan, chance: Random) -> dict[str, Any]:
    """Draw the keys that only some kinds have."""
    processes = [identity for identity in plan.identities if identity not in plan.witnesses]
    kinds = {plan.rows[identity].kind: [] for identity in processes}
    for identity in processes:
        kinds[plan.rows[identity].kind].append(identity)
    keys: dict[str, Any] = {}
    if kind in ("kill", "restart", "freeze", "clock"):
        keys["process"] = chance.choice(kinds[chance.choice(tuple(kinds))])
    match kind:
        case "cut" | "link":
            links: dict[tuple[str, str], list[tuple[str, str]]] = defaultdict(list)  # by the kinds at their ends
            for a, b in permutations(processes, 2):
                if plan.publishes_to(a, b):
                    links[plan.rows[a].kind, plan.rows[b].kind].append((a, b))
            keys["from"], keys["to"] = chance.choice(links[chance.choice(tuple(links))])
            if kind == "link":
                keys |= {"delay": chance.uniform(0.0, 0.3), "jitter": chance.uniform(0.0, 0.1)}
                keys |= {"loss": chance.uniform(0.0, 0.6), "reordering": chance.uniform(0.0, 0.2)}
        case "partition":
            keys["processes"] = chance.sample(processes, chance.randint(1, 3))
        case "noise":
            keys["noise"] = chance.uniform(0.002, 0.03)
        case "clock":
            reach = chance.choice((0.2, 5.0))
            keys["step"] = chance.uniform(-reach, reach)
        case "lag":
            keys |= {"lag": chance.uniform(0.0, 0.3), "dead_time": chance.uniform(0.0, 0.1)}
        case "told to end":
            keys["process"] = chance.choice(list(plan.pilots.values()))
    return keys


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
        self.world = World(swarm, flight.seed, DURATION, flight.of_world(), self.take)
        plan = self.world.plan
        self._drivers = [self.world.processes[name] for name, row in plan.rows.items() if row.driver]
        self._pilots = {identity: uav(drone) for drone, identity in plan.pilots.items()}
        self._frame: dict[str, Vector] = {}
        self._at = self._before = 0
        self._last: dict[str, Vector] = {}  # the frame before
        self._speeds: dict[str, Vector] = {}  # between the two frames before
        self._took_off: int | None = None
        self._stopped = False
        failures = [fault for fault in flight.faults if fault["kind"] == "failure"]
        self._fails = {uav(fault["drone"]): fault["at"] for fault in reversed(failures)}
        self._phases: dict[str, tuple[str, str]] = {}
        self._take = {"truth": self._truth, "status": self._status, "telemetry": self._telemetry,
                      "mission": self._mission, "stop": self._stop}  # fmt: skip

    def fly(self) -> Result:
        """Fly, judge the end too."""
        result, scheduler = self.result, self.world.scheduler
        scheduler.at(EPOCH + round(LONGEST * BILLION), lambda _: scheduler.stop())
        outcome = self.world.run()
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
        """Take in what is published."""
        take = self._take.get(published.key.kind)
        if take is not None:
            opened = published.sample.opened()
            assert opened is not None
            take(published, opened[0])

    @property
    def _now(self) -> float:
        """The time in s after the order to take off."""
        return (self.world.scheduler.now - (self._took_off or EPOCH)) / BILLION

    def _mission(self, _: Published, message: Mission) -> None:
        if self._took_off is None:
            self._took_off = self.world.scheduler.now
            for fault in self.flight.faults:
                self._later(fault["at"], lambda fault=fault: self._inject(fault))
        self._tell(f"order: {message.verb}")

    def _inject(self, fault: dict[str, Any]) -> None:
        processes, kind = self.world.processes, fault["kind"]
        self._tell(f"fault: {fault}")
        if kind == "stop":
            self.world.stop("bench")
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
        scheduler.at(scheduler.now + round(seconds * BILLION), lambda _: action())

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
        aloft = [(owner, place, self._falls(owner, now)) for owner, place in frame.items() if place[2] > IN_THE_AIR]
        for (one, a, falls), (other, b, drops) in combinations(aloft, 2):
            gap = dist(a, b)
            if falls or drops:
                result.struck = result.struck if falls and drops else min(result.struck, gap)
            elif gap < result.closest:
                if gap < COLLISION <= result.closest:
                    self._bad(f"collision of {one} and {other}")
                result.closest = gap
        dt = (self._at - self._before) / BILLION
        if dt > PAUSE:  # the world stood still, or began again
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
        if self._took_off is None:
            return
        for rung in _told(report.phase, report.detail):
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


def _told(phase: str, detail: str) -> Iterator[str]:
    """Yield the rungs that a pilot's reason tells of."""
    yield from (rung for text, rung in REASONS.items() if detail.startswith(text))
    if detail == SHUTDOWN and phase in (Phase.HOLD, Phase.LANDING):
        yield "told to end: hold" if phase == Phase.HOLD else "told to end: land"
    elif detail.startswith("battery"):
        yield "battery: land" if phase == Phase.LANDING else "battery: refuses"
    elif detail.endswith("outside the fence"):
        yield "fence: land"


def fly(seed: int, say: Callable[[str], None] | None = None) -> Result:
    """Fly the flight of `seed`; `say` takes what happens, line by line."""
    return Judge(drawn(seed), say).fly()


def print_tables(results: list[Result]) -> None:
    """Print what became of all flights."""
    outcomes = ("flew on", "landed early", "struck by a fall", "world ended", "bad")
    rows: dict[str, Counter[str]] = defaultdict(Counter)
    for result in results:
        for kind in {fault["kind"] for fault in result.faults}:
            rows[kind][result.outcome] += 1
        rows["all"][result.outcome] += 1
        rows[f"law: {result.variant}"][result.outcome] += 1
    print(f"\n{'fault':24}{'flights':>9}" + "".join(f"{name:>18}" for name in outcomes))
    for kind in (*KINDS, *(f"law: {name}" for name in VARIANTS), "all"):
        print(f"{kind:24}{rows[kind].total():>9}" + "".join(f"{rows[kind][name]:>18}" for name in outcomes))
    print(f"\n{'rung':28}{'flights':>9}    s after the fault began (one fault, usual limits): median, longest")
    for rung in RUNGS:
        count = sum(rung in result.rungs for result in results)
        times = sorted(_times(rung, results))
        timed = f"{median(times):8.2f}{times[-1]:8.2f}   of {len(times)}" if times else ""
        print(f"{rung:28}{count:>9}{timed}")
    closest = min(results, key=lambda result: result.closest)
    fastest = max(results, key=lambda result: result.fastest_contact)
    print(f"\nclosest approach {closest.closest:.3f} m (seed {closest.seed})")
    print(f"fastest touch-down {fastest.fastest_contact:.2f} m/s (seed {fastest.seed})")
    print(f"longest flight {max(result.seconds for result in results):.1f} s")
    for result in results:
        if result.bad:
            kinds = ", ".join(f"{fault['kind']} {fault['at']:.1f}" for fault in result.faults)
            print(f"bad: --seed {result.seed}  {result.variant}: {kinds}: {'; '.join(result.bad)}")


def _times(rung: str, results: Iterable[Result]) -> Iterator[float]:
    """Yield how long after its only fault a flight under the usual limits reached a rung."""
    for result in results:
        if rung in result.rungs and result.usual and len(result.faults) == 1:
            since = result.rungs[rung] - result.faults[0]["at"]
            if since >= 0.0:
                yield since


def _flown(file: Path, seeds: range) -> list[Result]:
    """Return the flights of `seeds` that a call that was ended left in `file`."""
    lines = file.read_text().splitlines() if file.exists() else []
    results = [Result(**json.loads(line)) for line in lines if line.endswith("}")]
    return [result for result in results if result.seed in seeds]


def main() -> int:
    """Fly one or many; returns 1 when something was bad."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--flights", type=int, default=5000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--resume", action="store_true", help="go on with what is in the folder, of the same version")
    parser.add_argument("--seed", type=int)
    parser.add_argument("--out", type=Path, default=Path("runs/fault_flights"))
    options = parser.parse_args()
    if options.seed is not None:
        result = fly(options.seed, print)
        print(json.dumps(asdict(result), indent=1))
        return bool(result.bad)
    options.out.mkdir(parents=True, exist_ok=True)
    file = options.out / "flights.jsonl"
    wanted = range(options.first, options.first + options.flights)
    results = _flown(file, wanted) if options.resume else []
    done = {result.seed for result in results}
    seeds = [seed for seed in wanted if seed not in done]
    with Pool(options.jobs) as pool, file.open("a" if options.resume else "w") as log:
        for result in pool.imap(fly, seeds, chunksize=4):
            results.append(result)
            log.write(json.dumps(asdict(result)) + "\n")
            log.flush()
            if result.bad:
                print(f"bad: --seed {result.seed}: {'; '.join(result.bad)}", file=sys.stderr, flush=True)
    print_tables(results)
    return any(result.bad for result in results)


if __name__ == "__main__":
    sys.exit(main())
