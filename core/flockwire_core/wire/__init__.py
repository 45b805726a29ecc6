"""The wire, pure: processes, keys, publishers and subscribers, messages and their codec."""
