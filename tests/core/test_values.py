"""Records, named tuples, frozen dataclasses and enums are the same after a copy and a pickle, compiled or not.

Compiled code has forgotten most types of fields: the sources name them.
"""

import ast
import copy
import dataclasses
import enum
import importlib
import pickle
import types
import typing
from collections.abc import Callable

import pytest
from build_hook import ROOT, compiled_files
from flockwire_core.control.formation import Formation, FormationChange, line
from flockwire_core.control.graph import Graph
from flockwire_core.control.trajectory import Waypoints
from flockwire_core.domain.record import Record
from flockwire_core.loading import load_swarm
from flockwire_core.swarm.model import Swarm
from flockwire_core.wire.keys import Key
from flockwire_lab.faults.kinds import Kill
from flockwire_twins.kinematics.core import AirframeConditions

PLAIN = {int: 1, float: 1.5, str: "a", bool: True, bytes: b"a", object: "a", type: float, typing.Any: "a"}
PLAIN[type(None)] = None
ROW, FLOWN = line(2, 1.0, 0.0, 0.5), load_swarm(ROOT / "examples/paper_simulation.toml")
EXAMPLES = {
    Graph: Graph((1, 2), ((0, 1, 1.0), (1, 2, 0.5))),
    Formation: ROW,
    FormationChange: FormationChange(ROW, (0, 1), ROW, (1, 0), 3.0, 2.0),
    Waypoints: Waypoints(((1.0, 0.0, 0.0),), 0.5, loop=True),
    Swarm: FLOWN.model_copy(update={"topology": FLOWN.topology}),  # with what it keeps
    Kill: Kill(kind="kill", process="uav1", at=1.0),
    Key: Key("mission"),
    AirframeConditions: AirframeConditions(FLOWN.wind, {"uav1": (0.1, 0.05)}, frozenset({"uav2"})),
}


def value_classes():
    """Yield the module and the definition of each class of values that is compiled."""
    for file in compiled_files():
        module = ".".join(file.relative_to(ROOT).with_suffix("").parts[1:])
        nodes = ast.parse(file.read_text(encoding="utf-8")).body
        yield from ((module, node) for node in nodes if isinstance(node, ast.ClassDef) and is_value(node))


def is_value(node):
    bases = {ast.unparse(base) for base in node.bases}
    if bases & {"NamedTuple", "Record", "Enum", "IntEnum"}:
        return True
    return any("dataclass" in ast.unparse(mark) and "frozen=True" in ast.unparse(mark) for mark in node.decorator_list)


CLASSES = {f"{module}.{node.name}": (module, node) for module, node in value_classes()}
del CLASSES["flockwire_lab.process.Published"]  # its sample is a delivery, not a value


def fields(node):
    """Return the text of the type of each argument of the constructor."""
    own = [part for part in node.body if isinstance(part, ast.FunctionDef) and part.name == "__init__"]
    if own:
        return [ast.unparse(argument.annotation) for argument in own[0].args.args[1:]]
    lines = [part for part in node.body if isinstance(part, ast.AnnAssign)]
    return [text for text in (ast.unparse(line.annotation) for line in lines) if "ClassVar" not in text]


def sample(kind):
    """Return a value of the type `kind`."""
    origin, inner = typing.get_origin(kind), typing.get_args(kind)
    examples = PLAIN | EXAMPLES
    if kind in examples:
        value = examples[kind]
    elif origin is Callable:
        value = len
    elif origin is tuple:
        value = tuple(sample(each) for each in inner if each is not ...)
    elif origin is frozenset:
        value = frozenset({sample(inner[0])})
    elif origin in (typing.Union, types.UnionType):
        value = sample(inner[0])
    elif inner:
        value = {sample(inner[0]): sample(inner[1])} if len(inner) == 2 else [sample(inner[0])]
    elif issubclass(kind, enum.Enum):
        value = next(iter(kind))
    else:
        value = made(f"{kind.__module__}.{kind.__qualname__}")
    return value


def made(name):
    module, node = CLASSES[name]
    space = vars(importlib.import_module(module))
    kind = space[node.name]
    if kind in EXAMPLES or issubclass(kind, enum.Enum):
        return sample(kind)
    return kind(*(sample(eval(text, dict(space))) for text in fields(node)))


@pytest.mark.parametrize("name", CLASSES)
def test_a_value_survives_a_copy_and_a_pickle(name):
    value = made(name)
    for other in (pickle.loads(pickle.dumps(value)), copy.copy(value), copy.deepcopy(value)):
        assert other == value
        assert type(other) is type(value)
        assert repr(other) == repr(value)
    if dataclasses.is_dataclass(value):
        assert dataclasses.replace(value) == value
    elif isinstance(value, tuple | Record):
        assert value._replace() == value
