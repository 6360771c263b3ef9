"""Eight runs side by side: machine code that works on a vector of runs, made of the same kernels, with the same bits."""
