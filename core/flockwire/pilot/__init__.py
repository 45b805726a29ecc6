"""On board: what flies one drone, pure: phases, orders, staleness ladder, safety filter, landing, what is near."""
