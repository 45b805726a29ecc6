"""A simulated Tello: a faithful server of the SDK's protocol, and what it flies."""
