"""The same cores in virtual time, with an event queue as clock and a seeded network."""
