"""Monitors: limits that flight software watches, and what it does when they are passed."""
