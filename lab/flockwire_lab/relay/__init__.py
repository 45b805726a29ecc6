"""Faults on real links: a relay between the process that dials and the one that listens."""
