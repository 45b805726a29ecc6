"""The swarm file: its tables as frozen models, its formations, and the rules between its keys."""
