"""Round what is in the way: bent and free places, the way round bodies, the sidestep."""
