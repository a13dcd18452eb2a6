"""Where the command `lever` starts.

Ctrl-C ends it in one line before Python has read the rest, which takes a moment, and does nothing any more once all is
done: while Python ends, it would be a signal that kills.

Imports next to nothing, for the same reason. Ctrl-C in the 15 ms before that is Python's own: a traceback.
"""

import sys

try:
    import signal

    from ..runtime.exit_status import exit_at_once
except KeyboardInterrupt:
    sys.stderr.write("lever: interrupted\n")
    raise SystemExit(130) from None


def main() -> int:
    """Run main.main()."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # not where it is ignored, as by nohup
        signal.signal(signal.SIGINT, exit_at_once)
    from .main import main

    status = main()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    return status
