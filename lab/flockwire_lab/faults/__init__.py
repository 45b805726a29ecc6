"""Faults of a flight as data: their kinds, their file, and how they wrap cores."""
