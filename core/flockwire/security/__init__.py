"""Certificates: making them, and checking those that a process shows."""
