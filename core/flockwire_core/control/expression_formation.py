"""A formation by expressions: Python's parser reads their text, and only listed names and forms are taken."""

from __future__ import annotations

import ast
from collections.abc import Callable
from math import nan

from flockwire_core.control.expression import (
    CONSTANTS,
    FUNCTIONS,
    NAMES,
    VARIABLES,
    ExpressionError,
    Node,
    Number,
    Variable,
    apply,
    bound,
    derivative,
    function_of_time,
)
from flockwire_core.domain.vector import Vector

LONGEST = 300  # characters
DEEPEST = 40  # functions, signs and powers inside one another: derivatives grow with them
TOO_DEEP = f"is nested more than {DEEPEST} deep"
NO_EXPRESSION = "cannot be read"
FORBIDDEN = "is not allowed in an expression"
UNKNOWN = f"is not known; it may use {', '.join((*VARIABLES, *CONSTANTS))} and the functions {', '.join(NAMES)}"
_Axis = Callable[[float], float]
_OPERATORS = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.Mod: "%", ast.Pow: "^"}


def parse_expression(text: str) -> Node:
    """Return the tree of `text`, in which `^` is `**`; raises ExpressionError for all else than a short expression."""
    if len(text) > LONGEST:
        raise ExpressionError(f"has {len(text)} characters, the most is {LONGEST}")
    try:
        parsed = ast.parse(" ".join(text.split()).replace("^", "**"), mode="eval")
    except (SyntaxError, ValueError) as error:  # the latter for a NUL
        raise ExpressionError(f"{NO_EXPRESSION}: {error.msg if isinstance(error, SyntaxError) else error}") from None
    return _tree(parsed.body, 0)


def _tree(part: ast.expr, depth: int) -> Node:
    if depth > DEEPEST:
        raise ExpressionError(TOO_DEEP)
    match part:
        case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
            return Number(float(value))
        case ast.Name(id=name) if name in VARIABLES:
            return Variable(name)
        case ast.Name(id=name) if name in CONSTANTS:
            return Number(CONSTANTS[name])
        case ast.UnaryOp(op=ast.USub(), operand=inner):
            return apply("neg", _tree(inner, depth + 1))
        case ast.BinOp(left=left, op=operator, right=right) if type(operator) in _OPERATORS:
            return apply(_OPERATORS[type(operator)], _tree(left, depth), _tree(right, depth + 1))
        case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]) if name in NAMES:
            if len(arguments) != (arity := FUNCTIONS[name].arity):
                raise ExpressionError(f"{name}() takes {arity} argument{'s' * (arity > 1)}, not {len(arguments)}")
            return apply(name, *[_tree(argument, depth + 1) for argument in arguments])
        case ast.Name(id=name) | ast.Call(func=ast.Name(id=name)):
            raise ExpressionError(f"{name!r} {UNKNOWN}")
    raise ExpressionError(f"{ast.unparse(part)!r} {FORBIDDEN}")


class Parametric:
    """An expression for each axis: h_i(t) = [x, y, z](t, i, n) in m, t >= 0 in s, of rank i = 0 … n − 1, n = `count`.

    `axes` are the expressions of x, y and z; h_i' is their derivative. An undefined value is NaN. Raises
    ExpressionError for one that cannot be used, or whose derivative would jump.
    """

    def __init__(self, count: int, axes: tuple[str, ...]) -> None:
        self.count = count
        self._axes = tuple(map(parse_expression, axes))
        self._rates = tuple(map(derivative, self._axes))
        self._places: dict[int, tuple[_Axis, ...]] = {}  # x, y, z and their rates, by rank

    def offset(self, index: int, t: float) -> Vector:
        """Return h_i in m, world axes, at mission time t in s."""
        x, y, z, _, _, _ = self._places.get(index) or self._place(index)
        t = max(t, 0.0)
        return (_worth(x, t), _worth(y, t), _worth(z, t))

    def offset_rate(self, index: int, t: float) -> Vector:
        """Return h_i' in m/s, world axes, at mission time t in s."""
        _, _, _, x, y, z = self._places.get(index) or self._place(index)
        t = max(t, 0.0)
        return (_worth(x, t), _worth(y, t), _worth(z, t))

    def _place(self, index: int) -> tuple[_Axis, ...]:
        ranks = {"i": float(index), "n": float(self.count)}
        place = tuple(function_of_time(bound(tree, ranks)) for tree in (*self._axes, *self._rates))
        self._places[index] = place
        return place


def _worth(axis: _Axis, t: float) -> float:
    try:
        return axis(t)
    except (ValueError, ArithmeticError):
        return nan
