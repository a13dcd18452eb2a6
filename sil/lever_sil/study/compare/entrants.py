"""Which estimators are compared: the firmware's as they can be set up, and those of ../baselines, where a new one goes.

The firmware's are `ours`. Names: dual and joint are told the true noise and adapt nothing; *_shipped have every default
but what is known beforehand (the first guess, the lever); *_no_change are the same without change detection; *_r…_q…
are shipped, too, and told a measurement noise (r) and a process noise (q) wrong by a factor, or an uncertainty of the
first guess (prior) and a walk; *_fixed, *_annealing and *_robbins_monro are told the noise, and move the parameters by
that kind of walk.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from itertools import combinations

from lever_cdkf.firmware.config import Config, setting

from ..baselines import BASELINES
from ..candidate import candidate
from ..data import Estimator
from ..firmware import Firmware
from .cases import Case

OURS = ("dual", "joint")
_OF_THE_PAPER = ("algorithm1", "dual_ekf", "rls", "lms")
"""Baselines that the paper tried or names."""
_FACTORS = {"0.1": 0.1, "1": 1.0, "10": 10.0}


@dataclass(frozen=True)
class Entrant:
    """An estimator in the setting of a case."""

    name: str
    title: str
    ours: bool
    make: Callable[[Case], Estimator]
    reference: str = ""
    """The entrant against which errors are told besides."""


_CANDIDATES: dict[str, Entrant] = {}


def is_candidate(name: str) -> bool:
    """Return whether the name is that of somebody's class, MODULE:CLASS (../candidate.py)."""
    return ":" in name


def enter(name: str) -> None:
    """Let the class MODULE:CLASS take part in every case, in this process. Raise LeverError."""
    if name not in _CANDIDATES:
        _CANDIDATES[name] = Entrant(name, f"class {name}", False, _always(candidate(name)))


def entrants(case: Case) -> dict[str, Entrant]:
    """Return those of a case, by name, ours first."""
    if case.kind == "paper":
        chosen = _adaptations() + [each for each in _baselines() if each.name in _OF_THE_PAPER]
    elif case.kind == "protocol":
        chosen = _shipped()[:1] + [each for each in _baselines() if not each.name.startswith("algorithm1")]
    elif case.kind == "wrong noise":
        chosen = _given_noise() + _wrong()
    elif case.kind == "wrong tuning":
        chosen = _given_noise()[:1] + _wrongly_tuned()
    elif case.kind == "matched":
        chosen = _given_noise() + _shipped() + _baselines()
    else:
        chosen = _shipped() + _no_change() + _baselines()
    return {entrant.name: entrant for entrant in (*chosen, *_CANDIDATES.values())}


def _told(estimator: str, adaptation: str) -> Callable[[Case], Estimator]:
    """Return the firmware that is told the noise, without detection of changes."""

    def make(case: Case) -> Estimator:
        align = {"align_time": 0.0} if case.preload == "fixed" else {}
        still = {"change_threshold": 0.0, "noise_window": 0.0, **align}
        return Firmware(case.model, case.preload, estimator, adaptation, {**case.own_settings, **case.noise, **still})

    return make


def _given_noise() -> list[Entrant]:
    return [Entrant(name, f"firmware, {name}, told the noise", True, _told(name, "fixed")) for name in OURS]


def _adaptations() -> list[Entrant]:
    """With each of the paper's kinds of parameter noise."""
    kinds = {"fixed": "fixed walk", "annealing": "annealed walk", "robbins_monro": "walk by Robbins-Monro"}
    told = [
        Entrant(f"{name}_{kind}", f"firmware, {name}, told the noise, {title}", True, _told(name, kind))
        for name in OURS
        for kind, title in kinds.items()
    ]
    return [*told, Entrant("dual_shipped", "firmware, dual, as shipped", True, _with("dual", {}))]


def _with(estimator: str, settings: Mapping[str, float]) -> Callable[[Case], Estimator]:
    """Return the shipped firmware but for `settings`."""
    return lambda case: Firmware(case.model, case.preload, estimator, settings={**case.own_settings, **settings})


def _shipped() -> list[Entrant]:
    return [
        Entrant(
            f"{name}_shipped",
            f"firmware, {name}, as shipped",
            True,
            _with(name, {}),
            reference=f"{name}_no_change",
        )
        for name in OURS
    ]


def _no_change() -> list[Entrant]:
    still = {"change_threshold": 0.0}
    return [
        Entrant(f"{name}_no_change", f"firmware, {name}, without change detection", True, _with(name, still))
        for name in OURS
    ]


def _wrong() -> list[Entrant]:
    defaults = Config().settings

    def scaled_noise(r: float, q: float) -> dict[str, float]:
        factors = {"theta_noise": r, "theta_dot_noise": r, "theta_dot_process_noise": q}
        return {name: factor * defaults[name] for name, factor in factors.items()}

    return [
        Entrant(
            f"{name}_r{r}_q{q}",
            f"firmware, {name}, as shipped, R × {r}, Q × {q}",
            True,
            _with(name, scaled_noise(r_factor, q_factor)),
            reference=name,
        )
        for name in OURS
        for r, r_factor in _FACTORS.items()
        for q, q_factor in _FACTORS.items()
    ]


TUNED = {
    "r": ("theta_noise", "theta_dot_noise"),
    "q": ("theta_dot_process_noise",),
    "prior": ("m_p_sigma", "c_p_sigma", "k_p_sigma"),
    "walk": ("m_p_walk", "c_p_walk", "k_p_walk"),
}
"""What is set wrong together, by the word for it in a name: R, Q, uncertainty of the first guess, walk of the lever."""


def wrongly_tuned() -> Iterator[dict[str, str]]:
    """Yield the factors of what is set wrong: nothing, each of TUNED by 0.1 and by 10, and all pairs of these."""
    wrong = [(name, factor) for name in TUNED for factor in _FACTORS if factor != "1"]
    yield {}
    yield from ({name: factor} for name, factor in wrong)
    yield from (dict(pair) for pair in combinations(wrong, 2) if len(dict(pair)) == 2)


def tuning_name(wrong: Mapping[str, str]) -> str:
    """Return the name of the entrant that has these set wrong."""
    return "_".join(("dual", *(name + factor for name, factor in wrong.items()))) if wrong else "dual_shipped"


def _wrongly_tuned() -> list[Entrant]:
    """Return the shipped firmware; what leaves the range of its setting stays at the end of it."""

    def maker(wrong: Mapping[str, str]) -> Callable[[Case], Estimator]:
        def make(case: Case) -> Estimator:
            set_wrong = {}
            for group, factor in wrong.items():
                for name in TUNED[group]:
                    row = setting(name)
                    value = _FACTORS[factor] * case.own_settings.get(name, row.default)
                    set_wrong[name] = min(max(value, row.least), row.greatest)
            return _with("dual", set_wrong)(case)

        return make

    return [
        Entrant(
            tuning_name(wrong),
            ", ".join(["firmware, dual, as shipped", *(f"{name} × {factor}" for name, factor in wrong.items())]),
            True,
            maker(wrong),
            reference="dual",
        )
        for wrong in wrongly_tuned()
    ]


def _baselines() -> list[Entrant]:
    return [
        Entrant(name, f"{baseline.title} ({baseline.source})", False, _always(baseline.run))
        for name, baseline in BASELINES.items()
    ]


def _always(estimator: Estimator) -> Callable[[Case], Estimator]:
    return lambda _case: estimator
