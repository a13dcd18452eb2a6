"""One check: python tests/lint CHECK [ARGUMENT...]. Exits with 1, showing the findings, if there are any."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from lint import checks

CHECKS: dict[str, Callable[..., str]] = {
    check.__name__: check
    for check in (
        checks.layout,
        checks.tidy,
        checks.tidy_cross,
        checks.misra,
        checks.misra_image,
        checks.misra_posix,
        checks.analyzer,
        checks.python,
        checks.types,
    )
}


def main() -> int:
    name, *arguments = sys.argv[1:]
    findings = CHECKS[name](*arguments)
    sys.stderr.write(findings)
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
