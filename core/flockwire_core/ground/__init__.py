"""The operator's side, pure: the state of a fleet, the director of its flight, orders, planned changes."""
