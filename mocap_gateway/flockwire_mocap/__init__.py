"""The gateway: converts a tracking system's data to the poses that each drone may receive."""
