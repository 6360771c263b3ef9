"""Replays: a recorded run made again, verified, or played to others."""
