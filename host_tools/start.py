"""Where the command `lever` starts: Ctrl-C ends it in silence before Python has read the rest, which takes a moment.

Imports next to nothing, for the same reason.
"""

try:
    import signal

    from .exit_status import exit_at_once
except KeyboardInterrupt:
    raise SystemExit(130) from None


def main() -> int:
    """cli.main()."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # not where it is ignored, as by nohup
        signal.signal(signal.SIGINT, exit_at_once)
    from .cli import main

    return main()
