"""Runs as data, and what reads them."""
