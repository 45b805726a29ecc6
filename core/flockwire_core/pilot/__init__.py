"""On board, pure: phases, orders, staleness ladder, safety filter, landing, nearby bodies of one drone."""
