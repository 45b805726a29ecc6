"""Reads an expression into its tree, by precedence climbing; unlisted names are refused.

sum := product (("+" | "-") product)*     product := sign (("*" | "/" | "%") sign)*
sign := "-" sign | power                  power := atom (("^" | "**") sign)?
atom := number | variable | constant | function "(" sum ("," sum)* ")" | "(" sum ")"
"""

from __future__ import annotations

import re

from flockwire_core.control.expression import (
    CONSTANTS,
    FUNCTIONS,
    NAMES,
    VARIABLES,
    ExpressionError,
    Node,
    Number,
    Variable,
)
from flockwire_core.control.expression import apply as applied

LONGEST = 300  # characters
DEEPEST = 40  # brackets, signs and powers inside one another
_TOKEN = re.compile(r"\s*(?:(\d+\.?\d*(?:[eE][+-]?\d+)?|\.\d+(?:[eE][+-]?\d+)?)|([A-Za-z_]\w*)|(\*\*|[-+*/%^(),]))")


def parse_expression(text: str) -> Node:
    """Return the tree of `text`; raises ExpressionError with the forbidden and the allowed names."""
    if len(text) > LONGEST:
        raise ExpressionError(f"has {len(text)} characters, the most is {LONGEST}")
    return _Parser(_tokens(text)).parse()


def _tokens(text: str) -> list[str]:
    tokens, at, end = [], 0, len(text.rstrip())
    while at < end:
        found = _TOKEN.match(text, at)
        if found is None:
            raise ExpressionError(f"{text[at:].strip()[0]!r} is not allowed in an expression")
        tokens.append(found[found.lastindex or 0])
        at = found.end()
    return tokens


class _Parser:
    def __init__(self, tokens: list[str]) -> None:
        self._tokens, self._at, self._depth = tokens, 0, 0

    def parse(self) -> Node:
        """Return the tree of all tokens; raises ExpressionError."""
        node = self._sum()
        if self._next():
            raise ExpressionError(f"{self._next()!r} is in the place of an operator or the end")
        return node

    def _next(self) -> str:
        return self._tokens[self._at] if self._at < len(self._tokens) else ""

    def _take(self) -> str:
        token = self._next()
        self._at += 1
        return token

    def _sum(self) -> Node:
        node = self._product()
        while self._next() in ("+", "-"):
            node = applied(self._take(), node, self._product())
        return node

    def _product(self) -> Node:
        node = self._sign()
        while self._next() in ("*", "/", "%"):
            node = applied(self._take(), node, self._sign())
        return node

    def _sign(self) -> Node:
        self._depth += 1
        if self._depth > DEEPEST:
            raise ExpressionError(f"is nested more than {DEEPEST} deep")
        if self._next() == "-":
            self._take()
            node = applied("neg", self._sign())
        else:
            node = self._power()
        self._depth -= 1
        return node

    def _power(self) -> Node:
        node = self._atom()
        if self._next() in ("^", "**"):
            self._take()
            node = applied("^", node, self._sign())
        return node

    def _atom(self) -> Node:
        if self._next() == "(":
            self._take()
            node = self._sum()
            self._close("(")
            return node
        token = self._take()
        if token[:1].isdigit() or token[:1] == ".":
            return Number(float(token))
        if self._next() == "(" and token in NAMES:
            return self._call(token)
        if token in VARIABLES:
            return Variable(token)
        if token in CONSTANTS:
            return Number(CONSTANTS[token])
        raise ExpressionError(_unexpected(token))

    def _call(self, name: str) -> Node:
        self._take()
        arguments = [self._sum()]
        while self._next() == ",":
            self._take()
            arguments.append(self._sum())
        self._close(f"{name}(")
        arity = FUNCTIONS[name].arity
        if len(arguments) != arity:
            raise ExpressionError(f"{name}() takes {arity} argument{'s' * (arity > 1)}, not {len(arguments)}")
        return applied(name, *arguments)

    def _close(self, opened: str) -> None:
        if self._take() != ")":
            raise ExpressionError(f"{opened!r} is not closed")


def _unexpected(token: str) -> str:
    if not token:
        return "ends, but a number or a name must follow"
    if not token.isidentifier():
        return f"{token!r} is in the place of a number or a name"
    if token in NAMES:
        return f"{token!r} needs its arguments in brackets"
    names = ", ".join((*VARIABLES, *CONSTANTS))
    return f"{token!r} is not a known name; it may use {names} and the functions {', '.join(NAMES)}"
