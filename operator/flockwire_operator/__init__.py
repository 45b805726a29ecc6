"""What people operate a swarm with: station, command line, console, scripts, ROS 2."""
