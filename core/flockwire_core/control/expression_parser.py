"""Reads an expression into its tree: Python's parser reads its text, and only listed names and forms are taken."""

from __future__ import annotations

import ast

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
)

LONGEST = 300  # characters
DEEPEST = 40  # functions, signs and powers inside one another: derivatives grow with them
TOO_DEEP = f"is nested more than {DEEPEST} deep"
NO_EXPRESSION = "cannot be read"
FORBIDDEN = "is not allowed in an expression"
UNKNOWN = f"is not known; it may use {', '.join((*VARIABLES, *CONSTANTS))} and the functions {', '.join(NAMES)}"
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
