"""Before a flight: the quality of a tracker's data, and its frame on the field."""
