"""Estimators compared: the same data for all of them, how good they could be at best, and how good they are."""
