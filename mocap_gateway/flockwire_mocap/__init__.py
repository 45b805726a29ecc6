"""The gateway: from a tracking system to the poses that each drone may know."""
