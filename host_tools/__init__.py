"""The firmware from Python: library binding, CAN bus plug-in, codec, and the command `lever`.

Kept empty so that `lever --help` loads nothing heavy; see README.md for the modules.
"""
