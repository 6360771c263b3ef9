"""What viewers of others need: streams to Foxglove and Lichtblick, recordings for Rerun, and layouts for each of them."""
