"""Bags: runs recorded as rosbag2 folders with MCAP files; written crash-safe, read as NumPy arrays, compared, exported.

    from flight_graph.bags.writer import BagWriter
    from flight_graph.bags.reader import read_bag
"""
