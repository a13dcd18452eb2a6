"""The estimator's models in float64, and transfer functions."""
