"""Makes and tries the law that `[control] law` names; a user's own may fail in any way."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import cast

from pydantic import ValidationError

from flockwire_core.domain.motion import LeaderMotion
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import ZERO, Vector
from flockwire_core.dry_flight import IN_FORMATION, dry_flight
from flockwire_core.follower_law import follower_law, raised
from flockwire_core.law import Information, Law, Pace, Sense, check_decision
from flockwire_core.objects import FAILURES, load_object
from flockwire_core.parameters import law_parameters
from flockwire_core.swarm.laws import law_object
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.swarm.tables import Parameters
from flockwire_core.swarm.trajectories import course_of
from flockwire_core.swarm.validation import Problem, problems_of
from flockwire_core.swarm.wording import meant, shown
from flockwire_core.time_limit import limited
from flockwire_core.wire.information import declared as declared_by
from flockwire_core.wire.information import information_of, keeps_height, speakers
from flockwire_core.wire.law_form import FormError, LawForm, law_form, packed

UNDECLARED = "has no `information`, which says what it sees and sends; nothing: Information(leaders=(0, 1))"
HEIGHT = "the pilot holds the height, as the law does not: that of places and of leaders that climb is not flown"
NONE = "what `information` does not declare, or is not known yet, is None"

Checked = tuple[list[str], list[str], dict[str, float]]  # problems, notes, predicted rates, 1/s


class LawError(ValueError):
    """An unusable law; the text names it and the reason."""


def load_law(law: str) -> type[Law]:
    """Return the class that `law_object` names; raises LawError."""
    try:
        with limited():
            found = load_object(law)
    except FAILURES as error:  # importing a user's module may raise anything
        file, _, name = law.rpartition(":")
        if isinstance(error, AttributeError) and error.name == name:
            raise LawError(f"{file} has no {name}{meant(name, dir(error.obj))}") from error
        raise LawError(f"cannot import it: {raised(error)}") from error
    if not isinstance(found, type) or not callable(getattr(found, "step", None)):
        raise LawError("must be a class with a method step(observation)")
    return cast("type[Law]", found)


def law_problems(swarm: Swarm) -> Iterator[Problem]:
    """Yield what makes the law unusable: its import, what it declares, its parameters."""
    try:
        law = load_law(law_object(swarm))
        declared = declared_by(swarm)
    except LawError as error:
        yield Problem("control.law", f"{error}{_remedy(error.__cause__, swarm.control.law.rpartition(':')[0])}")
    except TypeError as error:
        yield Problem("control.law", str(error))
    else:
        if not (swarm.control.elsewhere or hasattr(law, "information")):
            yield Problem("control.law", UNDECLARED)
            return
        yield from (Problem("control.law", rule) for rule in _contradictions(declared, swarm))
        if hasattr(law, "plan") is not (declared.deadline > 0.0):
            yield Problem("control.law", "a method plan and a deadline > 0 in its information belong together: add one")
        yield from _of_leaders(declared, swarm)
        for place, edge in enumerate(swarm.graph.edges if not declared.signed else ()):
            if edge[2] < 0.0:
                rule = f"control.law = {swarm.control.law!r} takes weights above 0 only"
                yield Problem(f"graph.edges.{place}", rule, shown(edge))
        yield from _of_parameters(law, swarm)


def _remedy(cause: BaseException | None, module: str) -> str:
    """Return what helps if the module of the law itself was not found."""
    is_absent = isinstance(cause, ModuleNotFoundError) and cause.name == module.partition(".")[0]
    name = f"{module.removesuffix('.py')}.py"
    remedy = f"; {name} must be beside the swarm file, or the module installed"
    return remedy if is_absent or isinstance(cause, FileNotFoundError) else ""


def _of_leaders(declared: Information, swarm: Swarm) -> Iterator[Problem]:
    least, most = declared.leaders
    if not least <= len(swarm.leaders) <= most:
        counts = " to ".join(map(str, dict.fromkeys(declared.leaders)))
        rule = f"control.law = {swarm.control.law!r} needs {counts}, the file has {len(swarm.leaders)}"
        yield Problem("leaders", rule)


def _of_parameters(law: type[Law], swarm: Swarm) -> Iterator[Problem]:
    model = getattr(law, "Parameters", Parameters)
    if not hasattr(model, "model_validate_json"):
        yield Problem("control.law", "its Parameters must be a class of flockwire.law.Parameters")
        return
    try:
        model.model_validate_json(json.dumps(law_parameters(swarm, law)))
    except ValidationError as error:
        for problem in problems_of(error, model):
            yield problem._replace(key=f"control.parameters.{problem.key}".rstrip("."), value=problem.value or "")


def _contradictions(declared: Information, swarm: Swarm) -> Iterator[str]:
    """Yield what the law declares but the swarm cannot give, each with its remedy."""
    try:
        law_form(declared)
    except (FormError, NameError) as error:
        yield str(error)
    sensing = swarm.avoidance.sensing
    bodiless = {i for i in swarm.leaders if not swarm.leading[i].has_body}
    if declared.neighbours and bodiless.intersection(source for source, *_ in swarm.graph.edges):
        yield "it sees its neighbours, but leader.kind = 'virtual' has no body to be seen: give the leader one"
    yield from _idle(declared)
    if declared.around and declared.radius > 0.0 and sensing != "nearby":
        yield "it sees whoever is around, but avoidance.sensing = 'neighbours' has no sensor for that: use 'nearby'"
    if sensing == "neighbours" and not _knows_positions(declared):
        yield "it may not know its neighbours' positions, which avoidance.sensing = 'neighbours' sends: use 'nearby'"
    if not declared.directed:
        yield from _asymmetries(swarm)
    if swarm.auctioned and declared.message is not LeaderMotion:
        yield "places by an auction need a law that relays the leader (information = RELAYING): name the places"


def _idle(declared: Information) -> Iterator[str]:
    """Yield what it declares without what that is of."""
    if declared.radius > 0.0 and not declared.around:
        yield "its information has a radius, but nothing around is declared within it: add around, or drop the radius"
    if declared.pace is not Pace.STEP and declared.message is None:
        yield f"its information has pace = {declared.pace.name}, but no message that goes at it: declare its type"


def _asymmetries(swarm: Swarm) -> Iterator[str]:
    """Yield the first edge between followers without its reverse, or else the first of another weight than that."""
    weights = {edge[:2]: edge[2] for edge in swarm.graph.edges}
    lonely = [(j, i) for j, i in weights if (i, j) not in weights and not {i, j}.intersection(swarm.leaders)]
    uneven = [(j, i) for j, i in weights if weights.get((i, j), weights[j, i]) != weights[j, i]]
    if lonely or uneven:
        j, i = min(lonely or uneven)
        yield f"it needs a symmetric graph: add the edge [{i}, {j}] to graph.edges, with the weight of [{j}, {i}]"


def _knows_positions(declared: Information) -> bool:
    return bool(declared.neighbours & Sense.POSITION) or declared.message is LeaderMotion


def law_failures(swarm: Swarm) -> Iterator[Problem]:
    """Let the law lead once, make that of every follower, take dry steps with it: to find errors before a flight."""
    declared = information_of(swarm)
    form = law_form(declared)
    if not swarm.control.own_law:
        return
    if form is not None and not {*speakers(swarm)}.isdisjoint(swarm.leaders):
        yield from _lead_failures(swarm, form)
    for number in swarm.followers:
        when = "is made"
        try:
            with limited():
                law = follower_law(swarm, number)
                said, plan = list[object](), None
                for situation in dry_flight(swarm, number, said):
                    when, observation = situation
                    if plan is not None:
                        observation = observation._replace(plan=plan)
                    decision = law.step(observation)
                    check_decision(decision)
                    data = packed(decision.message, declared, form)
                    if form is not None and data is not None:
                        said.append(form.unpack(data))
                    if declared.deadline > 0.0 and observation.place is not None and hasattr(law, "plan"):
                        plan = law.plan(observation)
        except FAILURES as error:  # a user's class may raise anything
            absent = swarm.control.elsewhere and isinstance(error, ConnectionError)
            text = f"that of {uav(number)} fails when it {when}: {_explained(error)}"
            yield Problem("control.law", str(error) if absent else text)
            return


def _explained(error: BaseException) -> str:
    is_none = isinstance(error, TypeError | AttributeError) and "NoneType" in str(error)
    return raised(error) + (f"; {NONE}" if is_none else "")


def _lead_failures(swarm: Swarm, form: LawForm) -> Iterator[Problem]:
    """Let the law lead once."""
    try:
        with limited():
            form.pack(load_object(law_object(swarm)).lead(0.0, LeaderMotion(ZERO)))
    except FAILURES as error:
        yield Problem("control.law", f"its class method lead(t, motion) fails: {raised(error)}")


def law_check(swarm: Swarm) -> Checked:
    """Return problems, notes and predicted rates (1/s) by the law's own `check`; a problem if that raises."""
    law, formation = load_law(law_object(swarm)), swarm.build_formation()
    places = {i: formation.offset(rank, 0.0) for rank, i in enumerate(swarm.followers)}
    height = [HEIGHT] if _has_heights(swarm, places.values()) else []
    check = getattr(law, "check", None)
    if check is None:
        return [], height, {}
    if swarm.sole_leader is not None:
        places[swarm.sole_leader] = ZERO
    try:
        with limited():
            found = check(swarm.topology, places, law_parameters(swarm, law))
        kinds = (list | tuple, list | tuple, Mapping)
        if not isinstance(found, list | tuple) or len(found) != 3 or not all(map(isinstance, found, kinds)):
            raise TypeError(f"it must return problems and notes (lists of text) and rates (a dict), not {found!r}")
        problems, notes, rates = found
        return (
            [*map(str, problems)],
            [*map(str, notes), *height],
            {str(name): float(rate) for name, rate in rates.items()},
        )
    except FAILURES as error:  # a user's may raise anything
        return [f"its check fails: {raised(error)}"], [], {}


def _has_heights(swarm: Swarm, places: Iterable[Vector]) -> bool:
    """Return whether the pilot holds the height of a swarm whose `places` differ in it, or whose leaders climb."""
    if keeps_height(information_of(swarm)):
        return False
    courses = [course_of(leader) for leader in swarm.leading.values()]
    heights = [{height for _, _, height in places}]
    heights += [{course.position(float(t))[2] for t in range(60)} for course in courses]
    return any(max(some) - min(some) > 0.01 for some in heights)  # m


def step_time(swarm: Swarm, read: Callable[[], int]) -> float:
    """Return the s that a step in formation takes at least, by the clock `read` (ns); raises what the law raises."""
    number = swarm.followers[0]
    law, spent = follower_law(swarm, number), []
    said = list[object]()
    for when, observation in dry_flight(swarm, number, said):
        began = read()
        law.step(observation)
        if when == IN_FORMATION:
            spent.append(read() - began)
    return min(spent) / SECOND
