"""Lever CDKF from Python. These names stay; modules below may move.

Each is imported when it is first used, so that `import lever_cdkf` costs nothing: nor does typing, before the command
`lever` can catch Ctrl-C.
"""

from __future__ import annotations

TYPE_CHECKING = False  # typing's, to every type checker
if TYPE_CHECKING:
    from typing import Any

    from lever_sil.run.runner import simulate
    from lever_sil.scenarios.scenario import load as load_scenario

    from .errors import LeverError
    from .firmware.native import Config, Estimator, run_samples
    from .signals.estimate import estimate
    from .signals.result import Result

    __version__: str

__all__ = [
    "Config",
    "Estimator",
    "LeverError",
    "Result",
    "__version__",
    "estimate",
    "load_scenario",
    "run_samples",
    "simulate",
]

_NATIVE = "lever_cdkf.firmware.native"
_HOMES = {
    "Config": (_NATIVE, "Config"),
    "Estimator": (_NATIVE, "Estimator"),
    "estimate": ("lever_cdkf.signals.estimate", "estimate"),
    "LeverError": ("lever_cdkf.errors", "LeverError"),
    "Result": ("lever_cdkf.signals.result", "Result"),
    "run_samples": (_NATIVE, "run_samples"),
    "simulate": ("lever_sil.run.runner", "simulate"),
    "load_scenario": ("lever_sil.scenarios.scenario", "load"),
}


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from .runtime.provenance import version

        return version()
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    import importlib

    module, attribute = _HOMES[name]
    value = getattr(importlib.import_module(module), attribute)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
