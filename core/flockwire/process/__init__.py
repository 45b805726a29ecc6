"""How any core is run, without clock or sockets: when it steps, swarm time, injected faults."""
