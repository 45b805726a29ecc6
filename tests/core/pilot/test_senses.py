"""What is received of a neighbour's messages between two steps is bounded, and what is left out is counted."""

from __future__ import annotations

from flockwire_core.domain.law_message import LawMessage
from flockwire_core.pilot.senses import MOST_NEWS, Speaker
from flockwire_core.wire.information import numbers
from flockwire_core.wire.law_form import LawForm


def test_messages_beyond_what_a_step_gets_are_counted_as_lost():
    form = LawForm(numbers(1))
    content, speaker = numbers(1)((2.0,)), Speaker(1, 1.0, False, form)
    for k in range(1, MOST_NEWS + 3):
        speaker.take(LawMessage(k, "world", 7, k, ((k, form.pack(content)),)))
    assert (len(speaker.news), speaker.lost, speaker.newest.sequence) == (MOST_NEWS, 2, MOST_NEWS + 2)
