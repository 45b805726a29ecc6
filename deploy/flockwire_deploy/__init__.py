"""Deploys a swarm: containers on one machine, services on several hosts."""
