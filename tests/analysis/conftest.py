"""The flights that tests record: tests/shared/recorded_flights.py."""

from recorded_flights import fly, good_flight, small_disk, swarm_of_fixture, write_flight

__all__ = ["fly", "good_flight", "small_disk", "swarm_of_fixture", "write_flight"]
