"""A linear airframe: x_dot = A x + B u, y = C x + D u, with the collective pitch and a gust in, accelerations out.

A file is what another tool writes of its linearised helicopter: MAT (of MATLAB up to 7.2, or scipy.io.savemat) or NPZ
with the arrays A, B, C, D; or CSV whose first line is `states, N` and whose rows are those of [A B; C D].
"""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from lever_cdkf.errors import LeverError
from lever_cdkf.numeric.arrays import ComplexArray, FloatArray
from lever_cdkf.runtime.extras import require
from lever_cdkf.runtime.files import whole, write_text
from lever_cdkf.text.units import number_of

PITCH, GUST = range(2)
"""Inputs: collective pitch of the blades [rad], vertical force of a gust over the mass [m/s^2]."""
SEAT, SENSOR = range(2)
"""Outputs: z_ddot at the pilot's seat and at the accelerometer [m/s^2], up."""

MOST_STATES = 64
PLAUSIBLE = (1.0, 1e4)
"""z_ddot over pitch at 3 Hz [m/s^2 per rad]; the aircraft that come with the package have 40 to 130."""
_HIDDEN = 1e-9
"""Part of a direction below which inputs do not reach it, or outputs do not show it."""
_GROWS = 1e-6
"""Real part of a pole [1/s] that counts as unstable."""


@dataclass(frozen=True, eq=False)
class StateSpace:
    """(n, n), (n, 2), (2, n), (2, 2); other numbers of inputs and outputs until pick()."""

    a: FloatArray
    b: FloatArray
    c: FloatArray
    d: FloatArray

    def response(self, s: ComplexArray, output: int, given: int) -> ComplexArray:
        """Return the response of an output to an input at the complex frequencies s [rad/s]."""
        identity = np.eye(len(self.a))
        state = np.linalg.solve(s[:, None, None] * identity - self.a, self.b[:, [given]].astype(np.complex128))
        response: ComplexArray = (self.c[[output]] @ state)[:, 0, 0] + self.d[output, given]
        return response

    def pick(self, inputs: list[int], outputs: list[int]) -> StateSpace:
        """With these inputs and outputs alone."""
        return StateSpace(self.a, self.b[:, inputs], self.c[outputs], self.d[np.ix_(outputs, inputs)])

    def balanced(self) -> StateSpace:
        """Return the system with states in other units, by powers of two (after Osborne 1960).

        What enters each state is then as large as what leaves it: rounding is the same in all of them.
        """
        scale = np.ones(len(self.a))
        for _ in range(20):
            a = self.a * scale / scale[:, None]
            np.fill_diagonal(a, 0.0)
            enters = np.sum(np.abs(a), axis=1) + np.sum(np.abs(self.b), axis=1) / scale
            leaves = np.sum(np.abs(a), axis=0) + np.sum(np.abs(self.c), axis=0) * scale
            known = (enters > 0.0) & (leaves > 0.0)
            change = np.ones_like(scale)
            change[known] = np.exp2(np.round(0.5 * np.log2(enters[known] / leaves[known])))
            scale = scale * change
            if np.all(change == 1.0):
                break
        return StateSpace(self.a * scale / scale[:, None], self.b / scale[:, None], self.c * scale, self.d)

    def minimal(self) -> StateSpace:
        """Without the states that no input moves or no output shows; itself where there are none."""
        reached = _krylov(self.a, self.b)
        if reached.shape[1] < len(self.a):
            return self._within(reached).minimal()
        shown = _krylov(self.a.T, self.c.T)
        return self if shown.shape[1] == len(self.a) else self._within(shown).minimal()

    def _within(self, basis: FloatArray) -> StateSpace:
        return StateSpace(basis.T @ self.a @ basis, basis.T @ self.b, self.c @ basis, self.d)

    def poles(self) -> ComplexArray:
        """Eigenvalues of A [rad/s]."""
        return np.linalg.eigvals(self.a).astype(np.complex128)

    def write(self, path: Path, comment: str = "") -> None:
        """Write the system as a .mat, .npz or .csv file, whole or not at all; raise LeverError.

        `comment`: lines that begin with #, of a .csv file.
        """
        arrays = {name.upper(): value for name, value in vars(self).items()}
        kind = path.suffix.lower()
        if kind == ".csv":
            rows = np.vstack((np.hstack((self.a, self.b)), np.hstack((self.c, self.d)))).tolist()
            lines = [f"states, {len(self.a)}", *(", ".join(map(repr, row)) for row in rows)]
            write_text(path, comment + "\n".join(lines) + "\n")
        elif kind in (".mat", ".npz"):
            with whole(path) as unfinished, unfinished.open("wb") as file:
                _save(kind, file, arrays)
        else:
            raise LeverError(f"{path}: must end in .mat, .npz or .csv")


def _save(kind: str, file: Any, arrays: Mapping[str, FloatArray]) -> None:
    if kind == ".npz":
        np.savez(file, **arrays)  # type: ignore[arg-type]
        return
    require("files", "scipy")
    from scipy.io import savemat

    savemat(file, dict(arrays))


def _krylov(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return an orthonormal basis of what b, A b, A^2 b, ... span."""
    size = max(float(np.abs(a).max(initial=0.0)), 1e-300)
    basis, new = np.zeros((len(a), 0)), b / np.maximum(np.linalg.norm(b, axis=0), 1e-300)
    while new.shape[1]:
        for _ in range(2):  # twice is enough (Kahan)
            new = new - basis @ (basis.T @ new)
        directions, strengths, _ = np.linalg.svd(new, full_matrices=False)
        new = directions[:, strengths > _HIDDEN]
        basis = np.hstack((basis, new))
        new = a @ new / size
    return basis


# --- reading ---------------------------------------------------------------------------------------------------------


def read(path: Path) -> StateSpace:
    """Return what a file holds, as it stands: real and finite. Raise LeverError."""
    if not path.is_file():
        raise LeverError(f"{path}: no such file")
    try:
        arrays = _READERS[path.suffix.lower()](path)
    except KeyError:
        raise LeverError(f"{path}: a state space is a .mat, .npz or .csv file") from None
    except (OSError, EOFError, ValueError, zipfile.BadZipFile) as error:
        reason = getattr(error, "strerror", None) or "it is damaged"
        raise LeverError(f"{path}: {reason}") from None
    found: dict[str, FloatArray] = {}
    for name in "ABCD":
        if name not in arrays:
            raise LeverError(f"{path}: has no array {name}; a state space has A, B, C and D")
        found[name.lower()] = _real(np.atleast_2d(arrays[name]), f"{path}: {name}")
    return _shaped(StateSpace(**found), path)


def _real(array: Any, where: str) -> FloatArray:
    if array.dtype.kind not in "biufc" or array.ndim != 2:
        raise LeverError(f"{where} is no matrix of numbers")
    if array.dtype.kind == "c" and np.any(array.imag != 0.0):
        raise LeverError(f"{where} is complex; write the real form of each pair of conjugate modes")
    values: FloatArray = np.real(array).astype(np.float64)
    if not np.all(np.isfinite(values)):
        raise LeverError(f"{where} has a value that is not finite")
    return values


def _shaped(system: StateSpace, path: Path) -> StateSpace:
    n, m, p = len(system.a), system.d.shape[1], len(system.d)
    shapes = {"A": (n, n), "B": (n, m), "C": (p, n), "D": (p, m)}
    for name, shape in shapes.items():
        is_shape = getattr(system, name.lower()).shape
        if is_shape != shape:
            raise LeverError(f"{path}: {name} is {is_shape[0]} by {is_shape[1]}; it must be {shape[0]} by {shape[1]}")
    if n > MOST_STATES:
        raise LeverError(f"{path}: {n} states; {MOST_STATES} at most: reduce the model to what matters below 20 Hz")
    return system


def _mat(path: Path) -> Mapping[str, Any]:
    require("files", "scipy")
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    try:
        content = loadmat(path)
    except NotImplementedError:
        raise LeverError(f"{path}: is of MATLAB 7.3; save it with -v7") from None
    except MatReadError:
        raise LeverError(f"{path}: it is damaged") from None
    return {name.upper(): each for name, each in content.items() if len(name) == 1}


def _npz(path: Path) -> Mapping[str, Any]:
    with np.load(path, allow_pickle=False) as content:
        return {name.upper(): content[name] for name in content.files if len(name) == 1}


def _csv(path: Path) -> Mapping[str, Any]:
    lines = [line for line in path.read_text(encoding="utf-8-sig").splitlines() if line.strip() and line[0] != "#"]
    states = number_of(lines[0].split(",")[-1]) if lines and is_state_space(lines[0]) else np.nan
    rows = [[number_of(cell) for cell in line.split(",")] for line in lines[1:]]
    if not (states >= 0.0 and states == int(states)) or len({len(row) for row in rows}) != 1:
        raise LeverError(f"{path}: must begin with a line `states, N`, and have rows of equal length: [A B; C D]")
    matrix, n = np.array(rows), int(states)
    if min(matrix.shape) <= n:
        raise LeverError(f"{path}: {len(rows)} rows of {len(rows[0])}; [A B; C D] with {n} states has more")
    return {"A": matrix[:n, :n], "B": matrix[:n, n:], "C": matrix[n:, :n], "D": matrix[n:, n:]}


def is_state_space(line: str) -> bool:
    """Return whether a .csv file that begins with this line is one, not a frequency response."""
    return line.lower().startswith("states")


_READERS = {".mat": _mat, ".npz": _npz, ".csv": _csv}


def flyable(system: StateSpace, where: str) -> StateSpace:
    """Return an airframe of two inputs and two outputs, balanced and minimal.

    Raise LeverError where it is unstable, or of another scale than a helicopter.
    """
    system = system.balanced().minimal()
    poles = system.poles()
    worst = poles[np.argmax(poles.real)] if len(poles) else complex(-1.0)
    if worst.real > _GROWS:
        raise LeverError(
            f"{where}: the airframe is unstable: pole at {worst.real:.3g} {abs(worst.imag):+.3g}i rad/s; leave out its "
            "slow modes, or include the control laws that hold them"
        )
    at_3_hz = abs(complex(system.response(np.array([6j * np.pi]), SEAT, PITCH)[0]))
    if not PLAUSIBLE[0] <= at_3_hz <= PLAUSIBLE[1]:
        raise LeverError(
            f"{where}: z_ddot over pitch at 3 Hz is {at_3_hz:.3g} m/s^2 per rad; it must be {PLAUSIBLE[0]:g} to "
            f"{PLAUSIBLE[1]:g}: are these radians, metres, and accelerations?"
        )
    return system
