"""Sweeps: many runs of one scenario, one table."""
