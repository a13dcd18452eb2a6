"""Types of arrays, quantiles of distributions, and whether one signal is the derivative of another."""
