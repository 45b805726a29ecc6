"""The recorder: every message in one trace, and the report drawn from it."""
