"""Faults: what a scenario breaks, where and when; the truth that flight software has to find out."""
