"""The router of router mode: for networks in which the drones cannot reach each other."""
