"""The wire of ROS 2 over Zenoh, as rmw_zenoh has it: pure; runtime/ros_node.py is its session."""
