"""What a publisher says of its message beside it, its time and its count, as far as that can be true.

An insider may publish under its own keys whatever it likes; figures of a flight are not to be nonsense for that.
"""

from __future__ import annotations

from collections.abc import Collection
from itertools import pairwise

from flockwire.domain.time import SECOND
from flockwire.wire.inbox import BURST

FARTHEST = 10 * SECOND  # ns between publication and record: a receiver that was frozen, a clock that is not known yet


def published_at(claimed: int, received: int) -> int:
    """Return when a message was published, Unix ns: as `claimed` where it was `received` about then, else that."""
    return claimed if abs(received - claimed) <= FARTHEST else received


def count_lost(sequences: Collection[int], rate: int, duration: int) -> int:
    """Return how many messages are missing between those recorded within `duration` ns, by their `sequences`.

    No more than `rate` per s can have been published in a gap: a wider one is no count of messages.
    """
    most, found = rate * (duration // SECOND + 1 + BURST), sorted(set(sequences))
    gaps = (later - earlier - 1 for earlier, later in pairwise(found))
    return min(most, sum(gap for gap in gaps if gap <= most))
