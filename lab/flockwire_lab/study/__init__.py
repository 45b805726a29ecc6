"""Monte Carlo studies: one swarm flown many times in virtual time with variations, and the results."""
