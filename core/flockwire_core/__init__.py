"""flockwire: formation flight with one process per drone. The library of all processes."""
