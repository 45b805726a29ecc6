"""Poses from ROS 2: PoseStamped topics, or a PoseArray, of any motion capture driver."""
