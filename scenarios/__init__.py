"""Scenarios: one YAML file each; `flight run` finds them by name."""
