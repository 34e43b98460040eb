"""Bags: the messages of a rosbag2, and the publications of a run that they are of."""
