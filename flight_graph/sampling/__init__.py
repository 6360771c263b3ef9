"""Sampling plans: which values a campaign's draws have. A draw is a function of plan, seed, key and number alone."""
