"""Campaigns: many runs of one scenario in a folder, which any number of workers fill, chunk by chunk."""
