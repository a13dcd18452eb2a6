"""Where the command `lever` starts: Ctrl-C ends it in silence before Python has read the rest, which takes a moment.

Imports next to nothing, for the same reason.
"""

INTERRUPTED = 130
"""Exit status after Ctrl-C."""

try:
    import os
    import signal
except KeyboardInterrupt:
    raise SystemExit(INTERRUPTED) from None


def exit_at_once(*_: object) -> None:
    """A signal handler for as long as there is nothing to clean up."""
    os._exit(INTERRUPTED)


def main() -> int:
    """cli.main()."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # not where it is ignored, as by nohup
        signal.signal(signal.SIGINT, exit_at_once)
    from .cli import main

    return main()
