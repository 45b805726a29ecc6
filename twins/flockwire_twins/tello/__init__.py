"""A simulated Tello: a server of the SDK's protocol and an airframe."""
