"""lab/bench/drawn_flights.py flies each family at its own rate, until a flight is bad."""

from __future__ import annotations

from collections.abc import Callable

import drawn_flights
import pytest


def test_drawn_flights_end_at_the_first_bad_one(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def raises(seed: int) -> str:
        raise ZeroDivisionError(f"flight {seed}")

    def families(bad: Callable[[int], str]) -> tuple[tuple[Callable[[int], str], int], ...]:
        return ((lambda _: "", 1), (bad, 2))

    monkeypatch.setattr("sys.argv", ["drawn_flights.py", "--first", "1", "--rounds", "6"])
    monkeypatch.setattr(drawn_flights, "FAMILIES", families(lambda _: ""))
    assert drawn_flights.main() == 0
    monkeypatch.setattr(drawn_flights, "FAMILIES", families(raises))
    assert drawn_flights.main() == 1
    assert capsys.readouterr().out.splitlines() == [
        "none of 9 flights was bad",
        "bad: raises, seed 1: ZeroDivisionError: flight 1",
    ]
