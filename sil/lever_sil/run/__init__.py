"""A scenario run against an estimator, and what comes of it."""
