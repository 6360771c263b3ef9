"""Pictures of any bag and any campaign: fields over time, runs over each other, a metric over a parameter."""
