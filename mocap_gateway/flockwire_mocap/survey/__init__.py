"""Before a flight: what a tracker delivers of each body, and how its frame lies on the field."""
