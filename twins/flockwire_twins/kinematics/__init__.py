"""The simulated airframes of a swarm, with drivers for those that have no driver process."""
