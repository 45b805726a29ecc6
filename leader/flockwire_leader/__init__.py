"""The leader: a drone on a scripted trajectory, or a virtual point."""
