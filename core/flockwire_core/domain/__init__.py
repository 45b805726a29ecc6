"""Common types: vectors, bodies, motion, time. It imports no other module of flockwire."""
