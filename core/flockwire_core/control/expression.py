"""Expressions of formations: a closed tree of numbers, t, i, n and listed functions, and its derivative in t.

An expression's text is never executed: the tree has only names from the tables in this file.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from flockwire_core.domain.record import Frozen

TIME = "t"
VARIABLES = (TIME, "i", "n")
CONSTANTS: Mapping[str, float] = {"pi": math.pi, "e": math.e}


class ExpressionError(ValueError):
    """An expression that cannot be used; the text gives the reason."""


@dataclass(frozen=True, slots=True)
class Number(Frozen):
    """A constant."""

    value: float


@dataclass(frozen=True, slots=True)
class Variable(Frozen):
    """One of VARIABLES."""

    name: str


@dataclass(frozen=True, slots=True)
class Apply(Frozen):
    """A function of FUNCTIONS, by its name, of as many arguments as it takes."""

    function: str
    arguments: tuple[Number | Variable | Apply, ...]


Node = Number | Variable | Apply


class Function(NamedTuple):
    """A function and its partial derivatives; `partials` is None if these would jump."""

    value: Callable[..., float]
    arity: int
    partials: Callable[..., tuple[Node, ...]] | None


def apply(name: str, *arguments: Node) -> Node:
    """Return the node of a function of FUNCTIONS; numbers are evaluated, and neutral operations removed."""
    numbers = [argument.value for argument in arguments if isinstance(argument, Number)]
    if len(numbers) == len(arguments):
        return Number(_worth(FUNCTIONS[name].value, numbers))
    for place, argument in enumerate(arguments):
        if isinstance(argument, Number) and (name, place, argument.value) in _NEUTRAL:
            return arguments[1 - place]
        if isinstance(argument, Number) and (name, place, argument.value) in _ABSORBING:
            return argument
    return Apply(name, arguments)


def depends_on_time(node: Node) -> bool:
    """Return whether t is in the tree."""
    if isinstance(node, Apply):
        return any(depends_on_time(argument) for argument in node.arguments)
    return isinstance(node, Variable) and node.name == TIME


def derivative(node: Node) -> Node:
    """Return d/dt of the tree, f(a, b)' = f_a a' + f_b b'; raises ExpressionError if it would jump."""
    if not depends_on_time(node):
        return Number(0.0)
    if not isinstance(node, Apply):
        return Number(1.0)
    partials = FUNCTIONS[node.function].partials
    if partials is None:
        raise ExpressionError(
            f"{node.function!r} of a value that changes with t jumps, or its rate does; it may use only i and n"
        )
    total: Node = Number(0.0)
    for partial, argument in zip(partials(*node.arguments), node.arguments, strict=True):
        total = apply("+", total, apply("*", partial, derivative(argument)))
    return total


def bound(node: Node, values: Mapping[str, float]) -> Node:
    """Return the tree with the variables in `values` replaced."""
    if isinstance(node, Variable):
        return Number(values[node.name]) if node.name in values else node
    if isinstance(node, Apply):
        return apply(node.function, *(bound(argument, values) for argument in node.arguments))
    return node


def function_of_time(node: Node) -> Callable[[float], float]:
    """Return the tree, which has no variable but t, as a function of t, s.

    If it is not defined, the function raises ValueError or ArithmeticError, or returns a number that is not finite.
    """
    if isinstance(node, Number):
        value = node.value
        return lambda t: value
    if isinstance(node, Variable):
        return lambda t: t
    function, arguments = FUNCTIONS[node.function].value, [function_of_time(one) for one in node.arguments]
    first = arguments[0]
    if len(arguments) == 1:
        return lambda t: function(first(t))
    second = arguments[1]
    return lambda t: function(first(t), second(t))


def _worth(value: Callable[..., float], numbers: list[float]) -> float:
    try:
        return float(value(*numbers))
    except (ValueError, ArithmeticError):
        return math.nan


def _one(name: str) -> Callable[[Node], tuple[Node, ...]]:
    """Return the partials of a function whose derivative is another one of the same argument."""
    return lambda a: (apply(name, a),)


def _square(a: Node) -> Node:
    return apply("^", a, Number(2.0))


def _inverse(a: Node) -> Node:
    return apply("/", Number(1.0), a)


def _power(a: Node, b: Node) -> tuple[Node, ...]:
    base = apply("*", b, apply("^", a, apply("-", b, Number(1.0))))
    # Where the exponent is constant its partial is not needed, and log(a) need not exist.
    exponent = apply("*", apply("^", a, b), apply("log", a)) if depends_on_time(b) else Number(0.0)
    return base, exponent


def _arc(a: Node) -> Node:
    return _inverse(apply("sqrt", apply("-", Number(1.0), _square(a))))


def _atan2(a: Node, b: Node) -> tuple[Node, ...]:
    square = apply("+", _square(a), _square(b))
    return apply("/", b, square), apply("neg", apply("/", a, square))


FUNCTIONS: Mapping[str, Function] = {
    "+": Function(lambda a, b: a + b, 2, lambda a, b: (Number(1.0), Number(1.0))),
    "-": Function(lambda a, b: a - b, 2, lambda a, b: (Number(1.0), Number(-1.0))),
    "*": Function(lambda a, b: a * b, 2, lambda a, b: (b, a)),
    "/": Function(lambda a, b: a / b, 2, lambda a, b: (_inverse(b), apply("neg", apply("/", a, _square(b))))),
    "^": Function(math.pow, 2, _power),
    "%": Function(lambda a, b: a % b, 2, None),
    "neg": Function(lambda a: -a, 1, lambda a: (Number(-1.0),)),
    "sin": Function(math.sin, 1, _one("cos")),
    "cos": Function(math.cos, 1, lambda a: (apply("neg", apply("sin", a)),)),
    "tan": Function(math.tan, 1, lambda a: (_inverse(_square(apply("cos", a))),)),
    "asin": Function(math.asin, 1, lambda a: (_arc(a),)),
    "acos": Function(math.acos, 1, lambda a: (apply("neg", _arc(a)),)),
    "atan": Function(math.atan, 1, lambda a: (_inverse(apply("+", Number(1.0), _square(a))),)),
    "atan2": Function(math.atan2, 2, _atan2),
    "sinh": Function(math.sinh, 1, _one("cosh")),
    "cosh": Function(math.cosh, 1, _one("sinh")),
    "tanh": Function(math.tanh, 1, lambda a: (apply("-", Number(1.0), _square(apply("tanh", a))),)),
    "exp": Function(math.exp, 1, _one("exp")),
    "log": Function(math.log, 1, lambda a: (_inverse(a),)),
    "sqrt": Function(math.sqrt, 1, lambda a: (_inverse(apply("*", Number(2.0), apply("sqrt", a))),)),
    "abs": Function(math.fabs, 1, None),
    "floor": Function(lambda a: float(math.floor(a)), 1, None),
    "min": Function(lambda a, b: a if a <= b else b, 2, None),
    "max": Function(lambda a, b: a if a >= b else b, 2, None),
}
NAMES = tuple(name for name in FUNCTIONS if name.isidentifier() and name != "neg")
"""The functions that an expression calls by name."""

_NEUTRAL = {("+", 0, 0.0), ("+", 1, 0.0), ("-", 1, 0.0), ("*", 0, 1.0), ("*", 1, 1.0), ("/", 1, 1.0), ("^", 1, 1.0)}
_ABSORBING = {("*", 0, 0.0), ("*", 1, 0.0), ("/", 0, 0.0)}
