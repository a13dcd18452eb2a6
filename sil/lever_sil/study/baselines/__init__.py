"""What the firmware's filter is compared with: other people's estimators, each as published and fairly tuned.

All are `data.Estimator`: they get a batch of runs and report at samples. A new one is a module with its source at the
top and a line in BASELINES; nothing else knows them by name.
"""

from __future__ import annotations

from dataclasses import dataclass

from ..data import Estimator
from .algorithm1 import Algorithm1
from .dual_ekf import dual_ekf
from .joint_ekf import joint_ekf
from .joint_ukf import joint_ukf
from .lms import Nlms
from .rls import Rls

__all__ = ["BASELINES", "Baseline"]


@dataclass(frozen=True)
class Baseline:
    """An estimator with what a table says of it."""

    name: str
    title: str
    source: str
    run: Estimator


BASELINES = {
    baseline.name: baseline
    for baseline in (
        Baseline(
            "algorithm1",
            "sigma-point parameter filter from the measured state, full covariance, one sample ahead",
            "van der Merwe 2004",
            Algorithm1(),
        ),
        Baseline(
            "algorithm1_ahead",
            "the same, 30 ms ahead",
            "van der Merwe 2004",
            Algorithm1(ahead=0.03),
        ),
        Baseline(
            "dual_ekf",
            "dual extended Kalman filter with recurrent derivatives",
            "Wan and Nelson 2001, Nelson 2000",
            dual_ekf,
        ),
        Baseline("joint_ekf", "joint extended Kalman filter", "Kopp and Orford 1963, Jazwinski 1970", joint_ekf),
        Baseline("joint_ukf", "joint unscented Kalman filter", "Wan and van der Merwe 2000", joint_ukf),
        Baseline(
            "rls",
            "recursive least squares with exponential forgetting",
            "Ljung and Söderström 1983",
            Rls(),
        ),
        Baseline(
            "rls_regularised",
            "the same, without forgetting the first guess",
            "Gunnarsson 1996",
            Rls(regularised=True),
        ),
        Baseline("lms", "normalised least mean squares", "Elliott 2001", Nlms()),
    )
}
