"""The simulated tracker: serves simulated bodies in a real tracker's protocol."""
