"""Distributed formation laws of the literature, one file each: equation, symbols, units, source, checks."""
