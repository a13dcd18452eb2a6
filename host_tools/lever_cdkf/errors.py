"""Errors that a user can do something about: one line that says what, where, and what to do."""

from __future__ import annotations


class LeverError(Exception):
    """Base of all of them. The command `lever` prints the text as one line and ends with exit status 2."""


class SettingsError(LeverError):
    """A configuration or settings file that the firmware would refuse."""


class CodecError(LeverError):
    """A value that no frame can hold, or a frame that is not one of the messages of lever.dbc."""
