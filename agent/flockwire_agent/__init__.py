"""A follower: it estimates the leader, flies its place in the formation and avoids bodies."""
