"""Makes and tries the law that `[control] law` names; a user's own may fail in any way."""

from __future__ import annotations

import json
import traceback
from collections.abc import Callable, Iterator
from typing import cast

from pydantic import ValidationError

from flockwire_core.control.graph import LEADER
from flockwire_core.domain.body import Body, BodyKind
from flockwire_core.domain.motion import LeaderMotion, Motion
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import ZERO, Vector, add
from flockwire_core.law import Heard, Law, LawSettings, Observation, Place, check_decision
from flockwire_core.objects import load_object
from flockwire_core.parameters import law_settings
from flockwire_core.swarm.laws import law_object
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.swarm.tables import Model
from flockwire_core.swarm.validation import Problem, problems_of

START = 1_790_000_000 * SECOND  # Unix ns of a dry flight
OFF_PLACE: Vector = (0.1, -0.2, 0.05)  # m, of a drone from its place in a dry step
IN_FORMATION = "flies in formation"
BESIDE: Vector = (0.6, 0.8, 0.0)  # m, from a drone to a nearby body in a dry step


OUR_FRAMES = tuple(f"flockwire/{name}.py" for name in ("own_law", "law", "objects"))


class NoParameters(Model):
    """The parameters of a law without its own model."""


class LawError(ValueError):
    """An unusable law; the text names it and the reason."""


def load_law(law: str) -> type[Law]:
    """Return the class that `law_object` names; raises LawError."""
    try:
        found = load_object(law)
    except Exception as error:  # importing a user's module may raise anything
        raise LawError(f"cannot import it: {_raised(error)}") from error
    if not isinstance(found, type) or not callable(getattr(found, "step", None)):
        raise LawError("must be a class with a method step(observation)")
    return cast("type[Law]", found)


def make_law(law: str, settings: LawSettings) -> Law:
    """Return the law that `law_object` names, made from `settings`; raises LawError, and what its class raises."""
    return load_law(law)(settings)


def law_problems(swarm: Swarm) -> Iterator[Problem]:
    """Yield what makes the law unusable: its import, its parameters."""
    try:
        law = load_law(law_object(swarm))
    except LawError as error:
        module = swarm.control.law.rpartition(":")[0]
        missing = isinstance(error.__cause__, FileNotFoundError) or (
            isinstance(error.__cause__, ModuleNotFoundError) and error.__cause__.name == module.partition(".")[0]
        )
        name = module if module.endswith(".py") else f"{module}.py"
        remedy = f"; {name} must be beside the swarm file, or the module installed" if missing else ""
        yield Problem("control.law", f"{error}{remedy}")
        return
    model = getattr(law, "Parameters", NoParameters)
    try:
        model.model_validate_json(json.dumps(swarm.control.parameters))
    except ValidationError as error:
        for problem in problems_of(error, model):
            yield problem._replace(key=f"control.parameters.{problem.key}".rstrip("."), value=problem.value or "")


def law_failures(swarm: Swarm) -> Iterator[Problem]:
    """Make the law of every follower, and take dry steps with it, to find errors before a flight."""
    for number in swarm.followers if swarm.control.own_law else ():
        when = "is made"
        try:
            law = make_law(law_object(swarm), law_settings(swarm, number))
            for situation in dry_flight(swarm, number):
                when, observation = situation
                check_decision(law.step(observation))
        except Exception as error:  # a user's class may raise anything
            yield Problem("control.law", f"fails when that of {uav(number)} {when}: {_raised(error)}")
            return


def dry_flight(swarm: Swarm, number: int) -> Iterator[tuple[str, Observation]]:
    """Yield what the law of follower `number` observes in a few steps, each with its situation, to follow `when it`."""
    period = 1.0 / swarm.control.rate_hz
    leader = add(swarm.drone(LEADER).start if LEADER in swarm.flying else ZERO, (0.0, 0.0, swarm.limits.takeoff_height))
    rank = swarm.followers.index(number)
    place = Place(swarm.build_formation(), rank, START)
    start, flown = swarm.drone(number).start, add(add(leader, place.offset(0.0)), OFF_PLACE)
    kinds = (BodyKind.DRONE, BodyKind.OBSTACLE) if swarm.obstacles else (BodyKind.DRONE,)
    bodies = tuple([Body(kind, BESIDE, 0.0) for kind in kinds])
    estimates = swarm.topology.neighbours(number)
    for step, (when, position, reference) in enumerate(
        (
            ("has no pose yet", None, None),
            ("stands on the ground", start, None),
            *[(IN_FORMATION, flown, place)] * 4,
            ("flies on without a pose", None, place),
        )
    ):
        now = START + round(step * period * SECOND)
        motion = Motion(position, ZERO, position) if position is not None else None
        heard = [Heard(j, weight, j == LEADER, now, step, LeaderMotion(leader)) for j, weight in estimates.items()]
        near = bodies if reference is not None else ()
        yield when, Observation(
            t=(now - START) / SECOND if reference is not None else 0.0, dt=period, stamp=now, position=position,
            velocity=ZERO if motion is not None else None, bodies=near, heard=heard if motion is not None else (),
            place=reference, now=now, motion=motion,
        )  # fmt: skip


def step_time(swarm: Swarm, read: Callable[[], int]) -> float:
    """Return the s that a step in formation takes at least, by the clock `read` (ns); raises what the law raises."""
    number = swarm.followers[0]
    law, spent = make_law(law_object(swarm), law_settings(swarm, number)), []
    for when, observation in dry_flight(swarm, number):
        began = read()
        law.step(observation)
        if when == IN_FORMATION:
            spent.append(read() - began)
    return min(spent) / SECOND


def _raised(error: BaseException) -> str:
    """Return an error in one line, with the last place in the user's file."""
    frames = [f for f in traceback.extract_tb(error.__traceback__) if not f.filename.endswith(OUR_FRAMES)]
    frames = [f for f in frames if not f.filename.startswith("<frozen")]
    place = f" ({frames[-1].filename}:{frames[-1].lineno})" if frames else ""
    return f"{type(error).__name__}: {error}{place}"
