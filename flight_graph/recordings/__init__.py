"""Recordings: what a run leaves behind, as tracks in memory and as a bag that knows its scenario."""
