"""flockwire: formation flight with one process per drone. This is the library that all processes share."""
