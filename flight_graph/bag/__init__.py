"""Bags: recorded runs as rosbag2 folders with MCAP files, written crash-safe, read as NumPy arrays, compared, exported."""
