"""A formation by expressions of t, i and n, and their derivative in t.

Python's parser reads their text, and only listed names and forms are taken: nothing of it is executed.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

from flockwire_core.domain.vector import Vector

LONGEST = 300  # characters
DEEPEST = 40  # functions, signs and powers inside one another: derivatives grow with them
TOO_DEEP = f"is nested more than {DEEPEST} deep"
NO_EXPRESSION = "cannot be read"
FORBIDDEN = "is not allowed in an expression"
CONSTANTS: Mapping[str, float] = {"pi": math.pi, "e": math.e}
_OPERATORS = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.Mod: "%", ast.Pow: "^"}
_Axis = Callable[[float], float]


class ExpressionError(ValueError):
    """An expression that cannot be used; the text gives the reason."""


class Function(NamedTuple):
    """A function and its partial derivative by each argument; none if these would jump."""

    value: Callable[..., float]
    arity: int
    partials: tuple[Callable[..., float], ...] = ()


def _squares(a: float, b: float) -> float:
    return math.pow(a, 2.0) + math.pow(b, 2.0)


FUNCTIONS: Mapping[str, Function] = {
    "+": Function(lambda a, b: a + b, 2, (lambda a, b: 1.0, lambda a, b: 1.0)),
    "-": Function(lambda a, b: a - b, 2, (lambda a, b: 1.0, lambda a, b: -1.0)),
    "*": Function(lambda a, b: a * b, 2, (lambda a, b: b, lambda a, b: a)),
    "/": Function(lambda a, b: a / b, 2, (lambda a, b: 1.0 / b, lambda a, b: -(a / math.pow(b, 2.0)))),
    "^": Function(
        math.pow, 2, (lambda a, b: b * math.pow(a, b - 1.0) if b else 0.0, lambda a, b: math.pow(a, b) * math.log(a))
    ),
    "%": Function(lambda a, b: a % b, 2),
    "neg": Function(lambda a: -a, 1, (lambda a: -1.0,)),
    "sin": Function(math.sin, 1, (math.cos,)),
    "cos": Function(math.cos, 1, (lambda a: -math.sin(a),)),
    "tan": Function(math.tan, 1, (lambda a: 1.0 / math.pow(math.cos(a), 2.0),)),
    "asin": Function(math.asin, 1, (lambda a: 1.0 / math.sqrt(1.0 - math.pow(a, 2.0)),)),
    "acos": Function(math.acos, 1, (lambda a: -(1.0 / math.sqrt(1.0 - math.pow(a, 2.0))),)),
    "atan": Function(math.atan, 1, (lambda a: 1.0 / (1.0 + math.pow(a, 2.0)),)),
    "atan2": Function(math.atan2, 2, (lambda a, b: b / _squares(a, b), lambda a, b: -(a / _squares(a, b)))),
    "sinh": Function(math.sinh, 1, (math.cosh,)),
    "cosh": Function(math.cosh, 1, (math.sinh,)),
    "tanh": Function(math.tanh, 1, (lambda a: 1.0 - math.pow(math.tanh(a), 2.0),)),
    "exp": Function(math.exp, 1, (math.exp,)),
    "log": Function(math.log, 1, (lambda a: 1.0 / a,)),
    "sqrt": Function(math.sqrt, 1, (lambda a: 1.0 / (2.0 * math.sqrt(a)),)),
    "abs": Function(math.fabs, 1),
    "floor": Function(lambda a: float(math.floor(a)), 1),
    "min": Function(lambda a, b: a if a <= b else b, 2),
    "max": Function(lambda a, b: a if a >= b else b, 2),
}
NAMES = tuple(name for name in FUNCTIONS if name.isidentifier() and name != "neg")
"""The functions that an expression calls by name."""
UNKNOWN = f"is not known; it may use {', '.join(('t', 'i', 'n', *CONSTANTS))} and the functions {', '.join(NAMES)}"

_NEUTRAL = {("+", 0, 0.0), ("+", 1, 0.0), ("-", 1, 0.0), ("*", 0, 1.0), ("*", 1, 1.0), ("/", 1, 1.0), ("^", 1, 1.0)}
_ABSORBING = {("*", 0, 0.0), ("*", 1, 0.0), ("/", 0, 0.0)}


class Curve(NamedTuple):
    """A function of t, s: its value; its value and its derivative; whether it is constant.

    Where they are not defined, they raise ValueError or ArithmeticError, or return a number that is not finite.
    """

    value: _Axis
    both: Callable[[float], tuple[float, float]]
    is_constant: bool = False

    def rate(self, t: float) -> float:
        """Return the derivative."""
        return self.both(t)[1]


def parse_expression(text: str) -> ast.expr:
    """Return what `text` is, in which `^` is `**`; raises ExpressionError for all else than a short expression."""
    if len(text) > LONGEST:
        raise ExpressionError(f"has {len(text)} characters, the most is {LONGEST}")
    try:
        parsed = ast.parse(" ".join(text.split()).replace("^", "**"), mode="eval").body
    except (SyntaxError, ValueError) as error:  # the latter for a NUL
        raise ExpressionError(f"{NO_EXPRESSION}: {error.msg if isinstance(error, SyntaxError) else error}") from None
    curve_of(parsed, {"i": math.nan, "n": math.nan})
    return parsed


def curve_of(part: ast.expr, ranks: Mapping[str, float], depth: int = 0) -> Curve:
    """Return the curve for i and n in `ranks`; raises ExpressionError for a form not listed, or a rate that jumps.

    One for NaN jumps if that of any rank does.
    """
    if depth > DEEPEST:
        raise ExpressionError(TOO_DEEP)
    match part:
        case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
            return _constant(float(value))
        case ast.Name(id="t"):
            return Curve(lambda t: t, lambda t: (t, 1.0))
        case ast.Name(id=name) if name in ranks or name in CONSTANTS:
            return _constant(ranks[name] if name in ranks else CONSTANTS[name])
        case ast.UnaryOp(op=ast.USub(), operand=inner):
            return _apply("neg", [curve_of(inner, ranks, depth + 1)])
        case ast.BinOp(left=left, op=operator, right=right) if type(operator) in _OPERATORS:
            return _apply(_OPERATORS[type(operator)], [curve_of(left, ranks, depth), curve_of(right, ranks, depth + 1)])
        case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]) if name in NAMES:
            if len(arguments) != (arity := FUNCTIONS[name].arity):
                raise ExpressionError(f"{name}() takes {arity} argument{'s' * (arity > 1)}, not {len(arguments)}")
            return _apply(name, [curve_of(argument, ranks, depth + 1) for argument in arguments])
        case ast.Name(id=name) | ast.Call(func=ast.Name(id=name)):
            raise ExpressionError(f"{name!r} {UNKNOWN}")
    raise ExpressionError(f"{ast.unparse(part)!r} {FORBIDDEN}")


def _constant(value: float) -> Curve:
    return Curve(lambda t: value, lambda t: (value, 0.0), True)


def _apply(name: str, arguments: list[Curve]) -> Curve:
    """Return f(a, b) and f_a a' + f_b b'; numbers are evaluated, and neutral operations removed."""
    function, arity, partials = FUNCTIONS[name]
    numbers = {place: one.value(0.0) for place, one in enumerate(arguments) if one.is_constant}
    if len(numbers) == arity:
        return _constant(_value(function, *numbers.values()))
    for place, number in numbers.items():
        if (name, place, number) in _NEUTRAL:
            return arguments[1 - place]
        if (name, place, number) in _ABSORBING:
            return arguments[place]
    if not partials:
        raise ExpressionError(
            f"{name!r} of a value that changes with t jumps, or its rate does; it may use only i and n"
        )
    by_first, by_second = partials[0], partials[-1]
    first, second = arguments[0], arguments[-1]

    def of_one(t: float) -> tuple[float, float]:
        a, rate = first.both(t)
        return function(a), by_first(a) * rate

    def of_two(t: float) -> tuple[float, float]:
        a, a_rate = first.both(t)
        b, b_rate = second.both(t)
        if 1 in numbers:
            rate = by_first(a, b) * a_rate
        elif 0 in numbers:
            rate = by_second(a, b) * b_rate
        else:
            rate = by_first(a, b) * a_rate + by_second(a, b) * b_rate
        return function(a, b), rate

    x, y = first.value, second.value
    return Curve(lambda t: function(x(t)), of_one) if arity == 1 else Curve(lambda t: function(x(t), y(t)), of_two)


class Parametric:
    """An expression for each axis: h_i(t) = [x, y, z](t, i, n) in m, t >= 0 in s, of rank i = 0 … n − 1, n = `count`.

    `axes` are the expressions of x, y and z; h_i' is their derivative. An undefined value is NaN. Raises
    ExpressionError for one that cannot be used, or whose derivative would jump.
    """

    def __init__(self, count: int, axes: tuple[str, ...]) -> None:
        self.count = count
        self._axes = tuple(map(parse_expression, axes))
        self._places: dict[int, list[Curve]] = {}  # x, y, z by rank

    def offset(self, index: int, t: float) -> Vector:
        """Return h_i in m, world axes, at mission time t in s."""
        x, y, z = self._places.get(index) or self._place(index)
        t = max(t, 0.0)
        return (_value(x.value, t), _value(y.value, t), _value(z.value, t))

    def offset_rate(self, index: int, t: float) -> Vector:
        """Return h_i' in m/s, world axes, at mission time t in s."""
        x, y, z = self._places.get(index) or self._place(index)
        t = max(t, 0.0)
        return (_value(x.rate, t), _value(y.rate, t), _value(z.rate, t))

    def _place(self, index: int) -> list[Curve]:
        ranks = {"i": float(index), "n": float(self.count)}
        self._places[index] = place = [curve_of(axis, ranks) for axis in self._axes]
        return place


def _value(function: Callable[..., float], *numbers: float) -> float:
    """Return the function's value, NaN where it is not defined."""
    try:
        return float(function(*numbers))
    except (ValueError, ArithmeticError):
        return math.nan
