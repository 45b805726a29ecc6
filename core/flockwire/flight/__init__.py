"""What pilots and operators share, pure: phases, the staleness ladder, the director, faults, when a core steps."""
