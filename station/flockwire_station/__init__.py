"""The operator's station: processes of this host, flights, orders, and what can be known of a swarm before."""
