"""Figures of many runs held against limits: what `lever envelope` and `lever bounce` print, write and answer with."""
