"""The firmware in Python, without CAN hardware: what other packages import.

`ffi` and `lib` are the whole façade (firmware/lever_cdkf.h), `Config` a checked configuration, `Estimator` one
instance, `run_samples` a whole recording at once, `model_parameters` what a model estimates.
"""

from .config import Config, Parameter, Setting, model_parameters, settings_table
from .estimator import DO_NOT_TRUST, FRAME_SAMPLE, Estimate, Estimator, Feedthrough, Health, fault_names, run_samples
from .library import enum_names, enum_words, ffi, lib

__all__ = [
    "DO_NOT_TRUST",
    "FRAME_SAMPLE",
    "Config",
    "Estimate",
    "Estimator",
    "Feedthrough",
    "Health",
    "Parameter",
    "Setting",
    "enum_names",
    "enum_words",
    "fault_names",
    "ffi",
    "lib",
    "model_parameters",
    "run_samples",
    "settings_table",
]
