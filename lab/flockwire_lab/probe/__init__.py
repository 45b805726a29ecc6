"""Proves on a running swarm that everything that key table and graph do not allow is refused."""
