"""How the parameters of a model are scaled for a filter, and their prior.

Positive parameters are filtered as w = ln(p / guess): they stay positive, and a random walk of w is a relative one.
Parameters of either sign are filtered as w = (p - guess) / sigma.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from lever_cdkf.numeric.arrays import Array

PARAMETERS = {
    "lever": ("m_p", "c_p", "k_p"),
    "linear_physical": ("m", "c", "k"),
    "linear_black_box": ("a21", "a22", "b21"),
    "hand": ("k_hand", "c_hand", "c_space"),
}
SIGNED = frozenset(("linear_black_box",))


@dataclass(frozen=True)
class Scale:
    """Of one model: the prior of its n parameters, and how they walk."""

    names: tuple[str, ...]
    positive: bool
    guess: Array  # (n,) in the units of the model
    unit: Array  # (n,) what a w of 1 adds to a signed parameter
    sigma: Array  # (n,) standard deviation of w before the first sample, which it never exceeds
    walk: Array  # (n,) least variance of the random walk of w [1/s]

    @classmethod
    def from_settings(cls, settings: Mapping[str, float], model: str) -> "Scale":
        """Return the rows of firmware/lever_settings.def that `model` uses."""
        if model not in PARAMETERS:
            raise ValueError(f'model: "{model}" is none of {", ".join(PARAMETERS)}')
        names = PARAMETERS[model]
        guess, sigma, walk = (
            np.array([settings[name + suffix] for name in names], np.float64) for suffix in ("", "_sigma", "_walk")
        )
        if model in SIGNED:
            return cls(names, False, guess, sigma, np.ones(len(names)), (walk / sigma) ** 2)
        return cls(names, True, guess, np.ones(len(names)), sigma, walk**2)

    def physical(self, w: Array) -> Array:
        """Return parameters in the units of the model, of w (n,) or (n, N)."""
        shape = (-1,) + (1,) * (w.ndim - 1)
        guess = self.guess.reshape(shape)
        p: Array = guess * np.exp(w) if self.positive else guess + self.unit.reshape(shape) * w
        return p

    def scaled(self, p: Array) -> Array:
        """w of parameters (n, N) in the units of the model; minus infinity where none can be (a positive one of 0)."""
        guess, unit = self.guess[:, np.newaxis], self.unit[:, np.newaxis]
        with np.errstate(divide="ignore"):
            w: Array = np.log(np.maximum(p, 0.0) / guess) if self.positive else (p - guess) / unit
        return w

    def slope(self, w: Array) -> Array:
        """dp/dw (n,)."""
        return self.physical(w) if self.positive else self.unit
