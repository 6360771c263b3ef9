"""Statistics of campaigns: intervals, percentiles, comparisons, sensitivities, rare events. Arrays in, numbers out."""
