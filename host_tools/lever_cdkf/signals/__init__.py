"""Signals of foreign logs, files and arrays as the samples that the firmware takes: see mapping.py."""
