"""Who receives from whom: the directed communication graph; leaders are its roots."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from math import inf

from flockwire_core.domain.record import Frozen


@dataclass(frozen=True, slots=True)
class Graph(Frozen):
    """Directed graph over leaders and followers; w_ij is not 0 iff i receives from j.

    `followers` and `leaders` have their ids, `edges` one (source, target, weight) = (j, i, w_ij) for each link: the
    target receives from the source. Raises ValueError for an unknown or repeated id, an edge into a leader, a link to
    itself, a repeated edge or a weight that is 0 or not finite.
    """

    followers: tuple[int, ...]
    edges: tuple[tuple[int, int, float], ...]
    leaders: tuple[int, ...] = (0,)

    def __post_init__(self) -> None:
        nodes = {*self.leaders, *self.followers}
        if len(nodes) != len(self.followers) + len(self.leaders):
            raise ValueError(f"followers = {self.followers}, leaders = {self.leaders}: all ids must differ")
        for place, rule in edge_problems(self.followers, self.leaders, self.edges):
            raise ValueError(f"edge {self.edges[place][0]} -> {self.edges[place][1]}: {rule}")

    def neighbours(self, i: int) -> dict[int, float]:
        """Return the in-neighbours N_i of follower i as {j: w_ij}; a leader 0 is in it iff a_i0 > 0."""
        return {source: weight for source, target, weight in self.edges if target == i}

    def out_neighbours(self, j: int) -> tuple[int, ...]:
        """Return the followers that receive from j, in the order of the edges."""
        return tuple(target for source, target, _ in self.edges if source == j)

    def depths(self) -> dict[int, int]:
        """Return the fewest hops from a leader to each node that one reaches; the leaders' are 0."""
        return _depths(self.leaders, ((source, target) for source, target, _ in self.edges))

    def unreachable(self) -> tuple[int, ...]:
        """Return the followers with no path from a leader; with one leader empty iff Assumption 2 (a tree) holds."""
        depths = self.depths()
        return tuple(i for i in self.followers if i not in depths)

    def parted(self) -> tuple[int, int] | None:
        """Return two followers so that links between followers do not lead from the first to the second, else None."""
        if not self.followers:
            return None
        first, links = self.followers[0], [edge[:2] for edge in self.edges if edge[0] not in self.leaders]
        onwards, back = _depths((first,), links), _depths((first,), ((target, source) for source, target in links))
        for i in self.followers:
            if i not in onwards:
                return first, i
            if i not in back:
                return i, first
        return None


def edge_problems(
    followers: tuple[int, ...], leaders: tuple[int, ...], edges: Sequence[tuple[int, int, float]]
) -> Iterator[tuple[int, str]]:
    """Yield the place of each edge that cannot be in a graph, and why."""
    known, seen = {*followers, *leaders}, set[tuple[int, int]]()
    for place, (source, target, weight) in enumerate(edges):
        broken = {
            f"there is no drone {source}": source not in known,
            f"there is no drone {target}": target not in known,
            "a leader has no in-neighbours": target in leaders,
            "a drone is not its own neighbour": source == target,
            "this edge appears twice": (source, target) in seen,
            f"weight = {weight} must be finite and not 0": not 0.0 < abs(weight) < inf,
        }
        seen.add((source, target))
        yield from ((place, rule) for rule, is_so in broken.items() if is_so)


def _depths(roots: tuple[int, ...], links: Iterable[tuple[int, int]]) -> dict[int, int]:
    """Return the fewest hops from one of `roots` to each node that `links` (source, target) lead to, their own too."""
    targets: dict[int, list[int]] = {}
    for source, target in links:
        targets.setdefault(source, []).append(target)
    depths = dict.fromkeys(roots, 0)
    frontier = [*roots]
    while frontier:
        reached: list[int] = []
        for source in frontier:
            for target in targets.get(source, ()):
                if target not in depths:
                    depths[target] = depths[source] + 1
                    reached.append(target)
        frontier = reached
    return depths
