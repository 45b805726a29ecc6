"""Drivers: from velocity commands to airframes, real or simulated."""
