"""Stepping through a graph: stop anywhere, look, go back, branch; in a terminal or from Python."""
