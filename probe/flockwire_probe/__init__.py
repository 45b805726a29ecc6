"""Proves on a running swarm that the wire refuses whatever key table and graph do not allow."""
