"""Replay: recorded logs through the firmware, piece by piece, and the files of a simulation from them: README.md."""
