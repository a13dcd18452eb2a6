"""The estimator on a CAN bus, or in a log of one."""
