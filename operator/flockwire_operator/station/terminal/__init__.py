"""The terminal: the live table, keys, standard streams, sticks."""
