"""The swarm file: its tables as frozen models, its formations, and the rules that tie its keys together."""
