"""Runs any core, without clock or sockets: steps, swarm time."""
