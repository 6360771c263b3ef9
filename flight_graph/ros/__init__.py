"""The ros engine: every component as one lifecycle node in its own process, joined by stamps.

Only this package imports rclpy.
"""
