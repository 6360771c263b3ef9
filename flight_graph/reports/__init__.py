"""Reports as one HTML file: figures that can be looked into, tables, and the data of both; no network."""
