"""The charts of the report: functions that take a Run and return a Figure, or None when the run lacks what it shows.

A new chart gets its place in ../page.py.
"""
