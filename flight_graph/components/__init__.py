"""Components: what they declare (records, ports, parameters), and where they are found."""
