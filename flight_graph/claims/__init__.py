"""Claims: what a paper states, recomputed from runs and judged."""
