"""Certificates: makes them, and checks those of a process."""
