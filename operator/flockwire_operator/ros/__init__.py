"""The swarm in ROS 2, over rmw_zenoh: topics and services, without an installation of ROS."""
