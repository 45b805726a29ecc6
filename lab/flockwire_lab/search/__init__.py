"""A search for the worst flight: faults of every kind, margins of properties, the smallest flight that violates one."""
