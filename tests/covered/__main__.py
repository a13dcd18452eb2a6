"""Says what of the core the tests do not reach: lines, branches and conditions (MC/DC).

    python tests/covered BUILD [--json FILE]

What is excluded has a number of firmware/COVERAGE.md.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from covered import measuring
from quality import tools


def main() -> int:
    parser = argparse.ArgumentParser(prog="covered", description=__doc__.splitlines()[0])
    parser.add_argument("build", type=lambda path: Path(path).resolve())
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures, and what is missing")
    args = parser.parse_args()
    try:
        found = measuring.measure(sources(args.build), args.build / "covered")
    except (measuring.CoverageError, FileNotFoundError) as error:
        print(f"covered: {error}", file=sys.stderr)
        return 2
    for each in found.missing:
        print(each)
    figures = {kind: round(found.share(kind), 2) for kind in found.count}
    print(", ".join(f"{kind} {share} % of {found.count[kind]}" for kind, share in figures.items()))
    print(f"{len(found.missing)} missing, {len(found.missing) - len(found.open)} of them excluded")
    if args.json:
        content = {
            **figures,
            "excluded": len(found.missing) - len(found.open),
            "open": [str(each) for each in found.open],
        }
        args.json.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
    return 0


def sources(build: Path) -> measuring.Sources:
    """Return those of the unit tests."""
    unit, bulk = tools.ROOT / "tests/unit", tools.ROOT / "host_tools/lever_cdkf/firmware/c"
    ports = [path for path in (tools.FIRMWARE / "port").rglob("*.c") if path.name != "main.c"]
    linux = [path for path in ports if "stm32f4" not in path.parts and path.parent.name != "build"]
    unity = build / "unity/unity.c"
    other = [
        *linux,
        *(bulk / name for name in ("candump.c", "feed.c", "numbers.c")),
        unit / "main.c",
        *([unity] if unity.exists() else []),
    ]
    include = [f"-I{path}" for path in (tools.FIRMWARE, bulk, unit, unity.parent, build / "firmware/build_headers")]
    flags = ["-std=c99", "-ffp-contract=off", "-fno-math-errno"]
    flags += [*include, "-w", "-DUNITY_INCLUDE_DOUBLE"]
    return measuring.Sources(tools.core_sources(), other, sorted(unit.glob("*/test_*.c")), flags, build)


if __name__ == "__main__":
    sys.exit(main())
