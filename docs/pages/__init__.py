"""The pages of the handbook's site that are made when it is built, and how the written ones get in."""
