"""The simulated airframes of a swarm, and the drivers of those without one of their own."""
