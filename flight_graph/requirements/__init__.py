"""Requirements: what a vehicle has to do, by which runs it is shown, and what was found."""
