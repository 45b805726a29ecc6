"""Monte Carlo: one swarm flown many times in virtual time, each time a little different, and what came of it."""
