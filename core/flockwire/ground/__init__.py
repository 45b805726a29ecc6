"""The operator's side, pure: what is known of a fleet, who conducts its flight, orders, planned changes."""
