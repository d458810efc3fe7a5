"""The controller once more, in plain NumPy and straight from the paper: what kernels are held against."""
