"""Units as FMI describes them: powers of SI base units."""

from __future__ import annotations

import re
from collections import Counter

_BASES: dict[str, dict[str, int]] = {
    "1": {},
    "s": {"s": 1},
    "Hz": {"s": -1},
    "m": {"m": 1},
    "kg": {"kg": 1},
    "rad": {"rad": 1},
    "N": {"kg": 1, "m": 1, "s": -2},
}
_FACTOR = re.compile(r"(1|[A-Za-z]+)(?:\^(\d+))?")


def base_units(unit: str) -> dict[str, int] | None:
    """Return the exponents of the base units of a unit such as "N m s/rad".

    None of one that is no product of whole powers, such as "dB" or "1/sqrt(s)".
    """
    exponents: Counter[str] = Counter()
    for place, part in enumerate(unit.split("/")):
        for factor in part.split(" "):
            match = _FACTOR.fullmatch(factor)
            if match is None or match[1] not in _BASES:
                return None
            power = int(match[2] or 1) * (-1 if place else 1)
            for base, exponent in _BASES[match[1]].items():
                exponents[base] += power * exponent
    return {base: exponent for base, exponent in exponents.items() if exponent}
