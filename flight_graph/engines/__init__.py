"""Engines in this process: the compiled loop and its plain-Python form."""
