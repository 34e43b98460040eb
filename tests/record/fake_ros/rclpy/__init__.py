"""As little of rclpy as its tracer touches, with the methods of rclpy 9."""
