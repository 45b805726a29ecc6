"""What carries a swarm to where it flies: containers on one machine, services on several hosts."""
