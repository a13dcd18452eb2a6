"""The loop of a pilot on his lever and a helicopter, linearised."""

from __future__ import annotations

import numpy as np
from lever_cdkf.models.transfer import Transfer
from lever_cdkf.numeric.arrays import ComplexArray
from lever_sil.aircraft import stability
from lever_sil.aircraft.aircraft import Coupled
from lever_sil.aircraft.tabulated import Tabulated


def loop_of(coupled: Coupled | Tabulated, transfer: Transfer, row: int) -> stability.Response:
    numerator, denominator = transfer.numerator[row], transfer.denominator[row]

    def loop(s: ComplexArray) -> ComplexArray:
        response: ComplexArray = coupled.response(s) * np.polyval(numerator, s) / np.polyval(denominator, s)
        return response

    return loop


def decibels(ratio: float) -> float:
    return float(20.0 * np.log10(ratio))
