"""A float64 oracle for the firmware's estimator, written from the equations and not from the C.

It does what the firmware does (firmware/THEORY.md, sections 1 and 2) the plain way: full sigma-point sets, every matrix
a numpy array, LAPACK's QR for every factor. It shares no code and no shortcut with the firmware, so where both agree
both are probably right. It is also the readable version of the estimator:

- `cdkf`             the square-root Central Difference Kalman Filter for any model: draw, predict, measure, update;
- `lever` `linear`   the models: the step of the motion, natural frequency and damping ratio;
- `scale`            how a model's parameters are scaled, and their prior;
- `belief`           the belief about state and parameters, and how samples change it: dual, joint, augmented; what
                     calibration errors make of it;
- `learning`         when the parameters learn, adaptation of their walk; `noise` and `change`: what innovations and
                     corrections say of the noise and of a sudden change;
- `detrend`          the high-pass of all signals;
- `estimator`        the whole estimator: inputs, trim, gaps, alignment.
"""

from lever_cdkf.models.lever import Lever

from .estimator import Estimator, Start, align, run

__all__ = ["Estimator", "Lever", "Start", "align", "run"]
