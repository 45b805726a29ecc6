"""The leader: a drone that a trajectory or a person steers, a body that a person carries, or a virtual point."""
