"""The operator's station: processes of this host, flights, orders, and checks before a flight."""
