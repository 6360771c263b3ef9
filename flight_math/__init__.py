"""Mathematics of the kernels: the same bits compiled, in plain Python and on every machine."""
