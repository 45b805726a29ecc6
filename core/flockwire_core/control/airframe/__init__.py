"""The airframe in equations: lag, dead time, gain, wind, and how its tracked body must answer."""
