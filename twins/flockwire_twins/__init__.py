"""Stand-ins for hardware: simulated airframes and drones, the servers of trackers."""
