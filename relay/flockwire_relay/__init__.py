"""Real links that break and slow down: a relay between the process that dials and the one that listens."""
