"""Scenes: what a vehicle looks like and how its frames move, as data that no viewer owns."""
