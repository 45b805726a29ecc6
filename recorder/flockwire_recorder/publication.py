"""A publisher's claimed time and count of a message, limited to plausible values.

An insider may publish any values under its own keys; the figures of a flight must still make sense.
"""

from __future__ import annotations

from collections.abc import Collection
from itertools import pairwise

from flockwire.domain.time import SECOND
from flockwire.wire.inbox import BURST

FARTHEST = 10 * SECOND  # ns between publication and record: a receiver that was frozen, a clock that is not known yet


def published_at(claimed: int, received: int) -> int:
    """Return when a message was published, Unix ns: `claimed` if it is near `received`, else `received`."""
    return claimed if abs(received - claimed) <= FARTHEST else received


def count_lost(sequences: Collection[int], rate: int, duration: int) -> int:
    """Return the number of missing messages within `duration` ns, from the recorded `sequences`.

    A gap counts only up to `rate` messages per s: a wider one is not a count of messages.
    """
    most, found = rate * (duration // SECOND + 1 + BURST), sorted(set(sequences))
    gaps = (later - earlier - 1 for earlier, later in pairwise(found))
    return min(most, sum(gap for gap in gaps if gap <= most))
