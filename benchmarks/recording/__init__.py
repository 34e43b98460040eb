"""Records real ROS 2: nodes of rclpy, which write down what they do."""
