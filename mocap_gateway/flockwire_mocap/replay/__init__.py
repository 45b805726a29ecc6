"""The poses of an earlier flight as a source."""
