"""What travels between nodes: signals, their ROS types, constant parts, topic names and quality of service."""
