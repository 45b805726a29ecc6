"""How rules of a swarm file are applied: one that leans on a key which is wrong already is not looked at."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator

from flockwire.swarm.model import Swarm

Rule = Callable[[Swarm], Iterable[str]]
_NEEDS: dict[Rule, tuple[str, ...]] = {}


def needs(*keys: str) -> Callable[[Rule], Rule]:
    """Name the keys on which a rule leans: it is not looked at while one of them is wrong."""

    def named(rule: Rule) -> Rule:
        _NEEDS[rule] = keys
        return rule

    return named


def broken(swarm: Swarm, rules: Iterable[Rule], wrong: set[str]) -> Iterator[str]:
    """Yield what `rules` find wrong, which is added to `wrong`; a rule that leans on a `wrong` key is left out."""
    for rule in rules:
        keys = _NEEDS.get(rule, ("",))
        if any(_within(one, other) for one in keys for other in wrong):
            continue
        for line in rule(swarm):
            yield line
            key = re.match(r"[\w.-]*", line)
            wrong.add(".".join(part for part in (key[0] if key else "").split(".") if not part.isdigit()))


def _within(one: str, other: str) -> bool:
    """Return whether one of two keys is the other, or stands in it; the empty key is the whole file."""
    return not one or not other or f"{one}.".startswith(f"{other}.") or f"{other}.".startswith(f"{one}.")
