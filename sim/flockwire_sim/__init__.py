"""The same cores in virtual time: an event queue for a clock, a seeded network between them."""
