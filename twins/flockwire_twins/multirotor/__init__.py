"""A multirotor of six degrees of freedom: dynamics, autopilot, figures of real and simulated vehicles."""
