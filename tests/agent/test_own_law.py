"""A law of your own: the example of docs/own_law.md flies, a law that fails makes its drone hold."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w
from flockwire.law import RELAYING, SECOND, Decision, LawSettings, LeaderMotion, Observation
from flockwire_agent import guarded_law
from flockwire_agent.gains import PaperGains
from flockwire_core import law
from flockwire_core.law import check_decision
from flockwire_core.loading import SwarmFileError, load_swarm
from flockwire_core.own_law import NONE, UNDECLARED, load_law
from flockwire_core.parameters import law_settings
from flockwire_core.swarm.laws import BUILT_IN
from flockwire_core.swarm.model import Swarm

STARTS = [[0.0, 0.0], [1.6, 0.3], [-1.4, 0.2]]
PLACES = {1: [1.0, 1.0, 0.0], 2: [-1.0, 1.0, 0.0]}


SOON = 20  # steps of a law after which it fails: more than `check` takes


class Failing:
    """Flies into the sky, then fails."""

    information = RELAYING

    def __init__(self, settings: LawSettings) -> None:
        self.number, self.steps = settings.number, 0

    def step(self, seen: Observation) -> Decision:
        self.steps += seen.place is not None
        if self.steps > SOON and self.number == 1:
            raise ArithmeticError("no way")
        return Decision((0.0, 0.0, 0.0), LeaderMotion((0.0, 0.0, 1.0)))


class OnTheGround(Failing):
    """Fails before it flies, made again or not."""

    taken = 0  # steps of all

    def step(self, seen: Observation) -> Decision:
        OnTheGround.taken += 1
        return self.fail(seen.now) if OnTheGround.taken > SOON else Decision()

    def fail(self, now: int) -> Decision:
        raise NotImplementedError


class Unready(Failing):
    """Cannot be made for the second follower."""

    def __init__(self, settings: LawSettings) -> None:
        if settings.number == 2:
            raise KeyError("no map of the hall")
        super().__init__(settings)


class NotFinite(OnTheGround):
    """Wants what cannot be flown."""

    def fail(self, now: int) -> Decision:
        return Decision((float("nan"), 0.0, 0.0), LeaderMotion((0.0, 0.0, 1.0)))


class TwoNumbers(OnTheGround):
    """Forgets the height."""

    def fail(self, now: int) -> Decision:
        return Decision((0.0, 0.0), LeaderMotion((0.0, 0.0, 1.0)))  # type: ignore[arg-type]


class Seconds(OnTheGround):
    """Counts in seconds."""

    def fail(self, now: int) -> Decision:
        return Decision((0.0, 0.0, 0.0), LeaderMotion((0.0, 0.0, 1.0)), stamp=now / 1e9)  # type: ignore[arg-type]


def test_the_example_of_the_page_flies(
    documented_law: str, example: Callable[[str, str], str], fly_flock: Callable[..., Any]
) -> None:
    assert len([line for line in example("own_law", "python").splitlines() if line.strip()]) <= 34
    flown = fly_flock(STARTS, PLACES, {"control.law": documented_law}, 10.0)
    assert flown.failure == ""
    assert flown.error < 0.03
    assert flown.closest > 0.4


def test_the_example_needs_nothing_but_the_interface(example: Callable[[str, str], str]) -> None:
    assert set(re.findall(r"flockwire[\w.]*", example("own_law", "python"))) == {"flockwire.law"}


def test_every_name_of_the_interface_is_documented() -> None:
    page = (Path(__file__).parents[2] / "docs" / "own_law.md").read_text(encoding="utf-8")
    assert [name for name in law.__all__ if f"`{name}`" not in page] == []


def test_the_settings_are_those_of_the_drone_and_the_swarm_file(make_swarm: Callable[..., Swarm]) -> None:
    airframe = {"airframes.kinematics": {"lag": 0.25, "dead_time": 0.1}}
    swarm = make_swarm({**airframe, "control.rate_hz": 50, "limits.speed": 1.5, "control.formation_gain": 2.0})
    settings = law_settings(swarm, 2)
    assert (settings.number, settings.period, settings.lag, settings.dead_time) == (2, 0.02, 0.25, 0.1)
    assert (settings.speed, settings.acceleration) == (1.5, swarm.limits.acceleration)
    assert settings.parameters["formation_gain"] == 2.0
    assert settings.guard.separation == swarm.avoidance.kept


def test_parameters_of_the_built_in_laws_are_those_of_the_tables_or_their_own(make_swarm: Callable[..., Swarm]) -> None:
    changes = {"control.law": "paper", "observer.gain": 2.0, "control.parameters": {"observer_exponent": 3.0}}
    gains = PaperGains.of(law_settings(make_swarm(changes), 1).parameters)
    assert (gains.observer_gain, gains.observer_exponent) == (2.0, 3.0)
    affine = load_swarm(Path(__file__).parents[2] / "laws/examples/affine.toml")
    assert law_settings(affine, 4).parameters == {"leader_places": {i: affine.drone(i).start for i in (1, 2, 3)}}
    with pytest.raises(SwarmFileError, match=r"control.parameters.observer_gain = -1.0"):
        make_swarm({**changes, "control.parameters": {"observer_gain": -1.0}})


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("formation_gain", 0.0),
        ("compensation_gain", -1.0),
        ("compensation_smoothing", 0.0),
        ("observer_gain", 0.0),
        ("observer_exponent", 1.0),
    ],
)
def test_gains_out_of_range_are_refused_by_name(make_swarm: Callable[..., Swarm], name: str, value: float) -> None:
    with pytest.raises(SwarmFileError, match=f"control.parameters.{name} = {value}"):
        make_swarm({"control.law": "paper", "control.parameters": {name: value}})
    given = law_settings(make_swarm({"control.law": "paper"}), 1).parameters
    with pytest.raises(ValueError, match=name):
        PaperGains.of({**given, name: value})


@pytest.fixture
def fly_law(fly_flock: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> Callable[[str], Any]:
    """Fly a law of this file for three seconds."""
    monkeypatch.setitem(sys.modules, "my_failing_law", sys.modules[__name__])
    monkeypatch.setattr(OnTheGround, "taken", 0)
    changes = {"graph.edges": [[0, 1], [0, 2]]}
    return lambda law: fly_flock(STARTS, PLACES, changes | {"control.law": f"my_failing_law:{law}"}, 3.0)


def test_a_law_that_fails_makes_its_drone_hold_and_report_why(fly_law: Callable[[str], Any]) -> None:
    flown = fly_law("Failing")
    assert any("the law failed: ArithmeticError: no way (test_own_law.py:" in detail for detail in flown.details)
    assert flown.closest > 1.0
    assert flown.lowest > 0.9


@pytest.mark.parametrize(
    ("law", "rule"),
    [
        ("NotFinite", "holds a number that is not finite"),
        pytest.param("TwoNumbers", "must be three numbers", marks=pytest.mark.long),
        pytest.param("Seconds", "the stamp must be an int, in ns", marks=pytest.mark.long),
    ],
)
def test_a_law_that_fails_on_the_ground_keeps_its_drone_there_and_reports_why(
    law: str, rule: str, fly_law: Callable[[str], Any]
) -> None:
    flown = fly_law(law)
    assert re.search("uav1: the law failed: (ValueError|TypeError)", flown.failure)  # compiled, of a record's types
    assert rule in flown.failure or "object expected; got" in flown.failure
    assert any("the law failed" in detail or "object expected; got" in detail for detail in flown.details)
    assert flown.highest < 0.01


WRONG_VECTORS = (
    [1.0, 2.0],
    np.ones((3, 1)),
    np.ones((2, 3)),
    np.array([1.0, np.nan, 3.0]),
    (np.ones(1), 0.0, 0.0),
    (10**400, 0, 0),
    (1j, 0.0, 0.0),
    "abc",
    None,
)


@pytest.mark.parametrize("vector", WRONG_VECTORS, ids=repr)
def test_a_vector_that_no_message_or_compiled_code_takes_is_refused_before_it_is_used(vector: Any) -> None:
    with pytest.raises((ValueError, TypeError, OverflowError)):
        check_decision(Decision(vector))
    with pytest.raises((ValueError, TypeError, OverflowError)):
        check_decision(Decision(message=LeaderMotion((0.0, 0.0, 0.0), vector)))


@pytest.mark.parametrize("stamp", [-1, 2**31 * SECOND, 10**30])
def test_a_stamp_that_no_message_holds_is_refused(stamp: int) -> None:
    with pytest.raises(ValueError, match="the stamp must be an int, in ns"):
        check_decision(Decision(stamp=stamp))


@pytest.mark.parametrize("vector", [(1, 2, 3), (True, 0.0, -1), tuple(np.array([1.0, 2.0, 3.0])), (1e300, 0.0, 0.0)])
def test_whole_numbers_and_numbers_of_numpy_are_floats(vector: Any) -> None:
    check_decision(Decision(vector, LeaderMotion(vector), stamp=2**31 * SECOND - 1))


@pytest.mark.parametrize(
    ("law", "line"),
    [
        ("fast", f"must be one of {sorted(BUILT_IN)} or your own class"),
        ("no_such_module:Law", "cannot import it: ModuleNotFoundError"),
        ("math:sqr", "math has no sqr; did you mean 'sqrt'?"),
        ("math:pi", "must be a class with a method step"),
    ],
)
def test_a_law_that_cannot_be_had_is_refused_by_name(law: str, line: str, make_swarm: Callable[..., Swarm]) -> None:
    with pytest.raises(SwarmFileError, match=re.escape(f"control.law = '{law}': {line}")):
        make_swarm({"control.law": law})


@pytest.mark.parametrize(
    ("parameters", "line"),
    [
        ({"gian": 2.0}, "control.parameters.gian = 2.0: unknown key; did you mean gain?"),
        ({"gain": -1}, "control.parameters.gain = -1: must be a number above 0"),
        ({"gain": "high"}, "control.parameters.gain = 'high': must be a number above 0"),
    ],
)
def test_parameters_are_held_against_the_model_that_the_law_names(
    documented_law: str, make_swarm: Callable[..., Swarm], parameters: dict[str, object], line: str
) -> None:
    with pytest.raises(SwarmFileError, match=re.escape(line)):
        make_swarm({"control.law": documented_law, "control.parameters": parameters})


def test_a_law_without_a_model_takes_no_parameters(make_swarm: Callable[..., Swarm]) -> None:
    with pytest.raises(SwarmFileError, match=r"control\.parameters\.gain = 2.0: unknown key"):
        make_swarm({"control.parameters": {"gain": 2.0}})


def test_parameters_reach_the_law(documented_law: str, make_swarm: Callable[..., Swarm]) -> None:
    given = {"control.law": documented_law, "control.parameters.gain": 5}
    for changes, gain in ((given, 5.0), ({"control.law": documented_law}, 2.0)):
        law = load_law(documented_law)(law_settings(make_swarm(changes), 1))
        assert vars(law)["gain"] == gain


def test_a_law_whose_constructor_fails_is_refused_with_its_line(
    make_swarm: Callable[..., Swarm], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "my_failing_law", sys.modules[__name__])
    with pytest.raises(
        SwarmFileError, match=r"that of uav2 fails when it is made: KeyError: 'no map of the hall' \(.*test_own_law"
    ):
        make_swarm({"control.law": "my_failing_law:Unready"})


def test_the_traceback_is_in_the_log(fly_law: Callable[[str], Any], caplog: pytest.LogCaptureFixture) -> None:
    guarded_law._shown.clear()
    fly_law("Failing")
    failed = [record.getMessage() for record in caplog.records if "the law failed" in record.getMessage()]
    assert 'raise ArithmeticError("no way")' in failed[0]
    assert [text.count("Traceback") for text in failed] == [1] + [0] * (len(failed) - 1)  # all fly one law here


LAW_FILE = """
import numpy
from flockwire.law import RELAYING, Decision, LeaderMotion
{imports}

class Law:
    information = RELAYING

    def __init__(self, settings):
        self.steps = 0

    def step(self, observation{more}):
        self.steps += 1
        {body}
"""


@pytest.fixture
def check_law(
    tmp_path: Path, swarm_table: Callable[..., dict[str, Any]], flockwire: Any
) -> Callable[..., tuple[int, str, str]]:
    """Return a function that checks a swarm file beside a law of the given body."""

    def check(body: str, law: str = "mine.py:Law", more: str = "", imports: str = "") -> tuple[int, str, str]:
        (tmp_path / "mine.py").write_text(LAW_FILE.format(body=body, more=more, imports=imports), encoding="utf-8")
        table = swarm_table({"control.law": law, "control.safety_filter": True})
        (tmp_path / "mine.toml").write_text(tomli_w.dumps(table), encoding="utf-8")
        done = flockwire("check", tmp_path / "mine.toml")
        return done.returncode, done.stdout, done.stderr

    return check


MISSING = "Law.step() missing 1 required positional argument"
GOOD = "return Decision(message=LeaderMotion((0.0, 0.0, 1.0)))"
IN_FORMATION = "if observation.place is not None: "


@pytest.mark.parametrize(
    ("body", "more", "said"),
    [
        (GOOD, ", now", f"that of uav1 fails when it has no pose yet: TypeError: {MISSING}"),
        ("return None", "", "has no pose yet: TypeError: a step must return a Decision, not None"),
        ("return [0.0, 0.0, 0.0]", "", "a step must return a Decision, not [0.0, 0.0, 0.0]"),
        ("return Decision((float('nan'), 0.0, 0.0))", "", "holds a number that is not finite"),
        ("return Decision((1 / (self.steps - 2), 0.0, 0.0))", "", "stands on the ground: ZeroDivisionError"),
        (f"{IN_FORMATION}1 / 0\n        {GOOD}", "", "flies in formation: ZeroDivisionError: division by zero ("),
        (f"observation.motion.position\n        {GOOD}", "", "has no pose yet: AttributeError"),
        (f"observation.neighbors\n        {GOOD}", "", "has no attribute 'neighbors'; did you mean 'neighbours'? ("),
        ("return Decision(signals={'V': float('inf')})", "", "signal 'V' = inf: must be a finite number"),
        ("return Decision(numpy.eye(3))", "", "command must be three numbers, is array([[1., 0., 0.], [0., 1., 0.]"),
        ("return Decision(error='x')", "", "error = 'x': must be a finite number, or None"),
        ("return Decision({1.0, 2.0, 3.0})", "", "command must be three numbers, is {1.0, 2.0, 3.0}"),
        ("return Decision((1j, 0.0, 0.0))", "", "command must be three numbers, is (1j, 0.0, 0.0)"),
        ("return Decision((None, 0.0, 0.0))", "", "command must be three numbers, is (None, 0.0, 0.0)"),
        ("return Decision((10**400, 0.0, 0.0))", "", "command must be three numbers, is (1"),
        ("return Decision(signals=['a'])", "", "signals = ['a']: must be numbers by name, a dict"),
        ("raise SystemExit(0)", "", "has no pose yet: SystemExit: 0 ("),
        ("raise ValueError('one\\ntwo')", "", "has no pose yet: ValueError: one two ("),
    ],
)
def test_check_takes_dry_steps_of_a_law(
    check_law: Callable[..., tuple[int, str, str]], body: str, more: str, said: str
) -> None:
    status, _, errors = check_law(body, more=more)
    assert status == 2
    assert said in errors
    assert len(errors.splitlines()) == 1
    raised = said.endswith(("AttributeError", "ZeroDivisionError", "("))
    assert ("mine.py:" in errors.partition(said)[2]) == raised
    assert "/flockwire_core/law.py" not in errors


@pytest.mark.parametrize("law", ["mine.py:Law", "mine:Law"])
def test_a_law_is_found_beside_its_swarm_file_from_any_folder(
    check_law: Callable[..., tuple[int, str, str]], law: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "mine.py").write_text("raise SystemExit('code of the current folder ran')", encoding="utf-8")
    monkeypatch.chdir(elsewhere)
    (tmp_path / "helper_of_mine.py").write_text("NUMBER = 1\n", encoding="utf-8")
    assert check_law(GOOD, law, imports="import helper_of_mine")[0] == 0


def test_a_law_whose_file_exits_is_refused(check_law: Callable[..., tuple[int, str, str]]) -> None:
    status, _, errors = check_law(GOOD, imports="raise SystemExit(0)")
    assert status == 2
    assert "cannot import it: SystemExit: 0 (mine.py:" in errors


def test_a_misspelt_field_and_a_sum_with_none_are_explained(check_law: Callable[..., tuple[int, str, str]]) -> None:
    errors = check_law(GOOD, imports="from flockwire.law import Information; Information(neighbors=1)")[2]
    assert "an unexpected keyword argument 'neighbors'; did you mean 'neighbours'?" in errors
    errors = check_law(f"observation.position + 1\n        {GOOD}")[2]
    assert re.search(rf"pose yet: TypeError: .*: 'NoneType' and 'int' \(mine\.py:\d+\); {re.escape(NONE)}\n$", errors)


def test_a_law_that_declares_nothing_is_refused(check_law: Callable[..., tuple[int, str, str]]) -> None:
    bare = "class Bare:\n    def __init__(self, settings): pass\n    def step(self, seen): return Decision()"
    assert UNDECLARED in check_law(GOOD, "mine.py:Bare", imports=bare)[2]


def test_a_class_that_its_file_has_not_is_named_as_the_user_wrote_it(
    check_law: Callable[..., tuple[int, str, str]], tmp_path: Path
) -> None:
    status, _, errors = check_law(GOOD, law="mine.py:Lwa")
    assert status == 2
    assert f"{tmp_path}/mine.py has no Lwa; did you mean 'Law'?" in errors


def test_a_law_file_hides_no_module(check_law: Callable[..., tuple[int, str, str]], tmp_path: Path) -> None:
    (tmp_path / "random.py").write_text("class Law:\n    pass\n", encoding="utf-8")
    status, _, errors = check_law(GOOD, "random.py:Law")
    assert status == 2
    assert "must be a class with a method step" in errors
    import random

    assert Path(random.__file__).parent != tmp_path


@pytest.mark.parametrize(
    ("law", "said"),
    [
        ("lost.py:Law", "lost.py must be beside the swarm file, or the module installed"),
        ("lost_law:Law", "lost_law.py must be beside the swarm file, or the module installed"),
    ],
)
def test_a_missing_law_names_where_it_is_searched(
    check_law: Callable[..., tuple[int, str, str]], law: str, said: str
) -> None:
    status, _, errors = check_law(GOOD, law)
    assert status == 2
    assert said in errors


def test_a_slow_law_is_named_by_check(
    check_law: Callable[..., tuple[int, str, str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    steps = iter(range(0, 10**15, 31_000_000))
    monkeypatch.setattr("flockwire_core.clock.monotonic", lambda: next(steps))
    status, printed, _ = check_law(GOOD)
    assert status == 0
    assert "a step takes 31 ms here, control.rate_hz = 100 leaves 10 ms: a real flight misses steps" in printed
