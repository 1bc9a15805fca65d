"""A response as a sum of partial fractions (pairs of poles, a real pole, integrators, direct terms), and what a person
reads from it: frequencies, dampings, residues, gains and delays.
"""

from __future__ import annotations

from math import pi

import numpy as np

from livebode.arrays import Complex, Floats
from livebode.dataclass import dataclass
from livebode.fitting.physical import EvaluationGrid
from livebode.fitting.transfer import Transfer, roots

_STEP = 1e-6  # of a frequency, for slopes


@dataclass(frozen=True)
class Structure:
    """Number of the terms that the outputs have in common, and whether each output has a delay.

    The nonlinear parameters are a1, a0 of each pair s² + a1·s + a0, a of a real pole s + a, and the delays. A pair may
    be complex or real, so that a search can pass from one to the other. The linear ones, for each output, are two for a
    pair, b1·s + b0, one for a real pole and for each of the integrators 1/s and 1/s², and the direct terms: 1 and one
    tick's delay of it behind a hold, else 1 and s. They are the effect of modes above the lines. The last pairs may be
    `residual`: poles outside of the lines that are no modes, the effect of what the direct terms do not follow.
    """

    outputs: int
    pairs: int = 0
    single: int = 0
    integrators: int = 0
    direct: int = 0
    delays: bool = False
    residual: int = 0

    @property
    def modes(self) -> int:
        """Number of pairs that are not residual."""
        return self.pairs - self.residual

    @property
    def nonlinear(self) -> int:
        return 2 * self.pairs + self.single + self.outputs * self.delays

    @property
    def linear(self) -> int:
        """Number of linear coefficients of each output."""
        return 2 * self.pairs + self.single + self.integrators + self.direct

    @property
    def size(self) -> int:
        """Number of parameters."""
        return self.nonlinear + self.outputs * self.linear

    @property
    def poles(self) -> int:
        """Number of poles without the integrators."""
        return 2 * self.pairs + self.single

    def pairs_of(self, theta: Floats) -> Floats:
        """a1 and a0, shape (..., pairs, 2)."""
        return theta[..., : 2 * self.pairs].reshape(*theta.shape[:-1], self.pairs, 2)

    def delays_of(self, theta: Floats) -> Floats:
        """Delay of each output in seconds, shape (..., outputs)."""
        if not self.delays:
            return np.zeros((*theta.shape[:-1], self.outputs))
        return theta[..., -self.outputs :]


def poles_of(structure: Structure, theta: Floats) -> Complex:
    """Poles without the integrators, those of a pair after each other, (..., poles)."""
    pairs = structure.pairs_of(theta)
    both = roots(np.concatenate([np.ones_like(pairs[..., :1]), pairs], axis=-1))
    single = -theta[..., 2 * structure.pairs : structure.poles].astype(np.complex128)
    return np.concatenate([both.reshape(*theta.shape[:-1], 2 * structure.pairs), single], axis=-1)


class PartialFractions:
    """The columns of a structure at some lines: a response is their sum with real weights.

    Parameters
    ----------
    structure, grid
        Terms, and where they are evaluated.
    unit
        ω in rad/s by which s is divided in each column, so that the weights have the unit of the response.
    """

    def __init__(self, structure: Structure, grid: EvaluationGrid, unit: float) -> None:
        self.structure, self.grid, self.unit = structure, grid, unit
        self._s = np.asarray(2j * np.pi * grid.frequency_hz, dtype=np.complex128)
        self._z = np.exp(self._s / grid.rate_hz)
        self._fixed: tuple[float, list[Complex]] | None = None  # columns that depend on the delay alone

    def columns(self, theta: Floats, delay_s: float) -> Complex:
        """Shape (lines, linear)."""
        of = self.structure
        pairs = of.pairs_of(theta)
        parts = [self.pairs(pairs[:, 0], pairs[:, 1], delay_s).reshape(2 * of.pairs, self._s.size)]
        if of.single:
            parts.append(self.real(theta[2 * of.pairs : 2 * of.pairs + 1], delay_s))
        if self._fixed is None or self._fixed[0] != delay_s:
            self._fixed = delay_s, self._integrators_and_direct(delay_s)
        return np.concatenate(parts + self._fixed[1]).T

    def moves(self, theta: Floats, delay_s: float) -> tuple[Complex, Complex]:
        """Derivatives of the columns by the parameters of their own poles, by central differences.

        Of a pair's two columns by a1 and a0, (2, pairs, 2, lines), and of a real pole's, (single, lines).
        """
        of = self.structure
        pairs, step = of.pairs_of(theta), self._steps(theta)
        by = step[: 2 * of.pairs].reshape(-1, 2)
        moved = pairs + np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])[:, np.newaxis] * by
        columns = self.pairs(moved[..., 0], moved[..., 1], delay_s)
        change = (columns[:2] - columns[2:]) / (2 * by.T[..., np.newaxis, np.newaxis])
        real, step = theta[2 * of.pairs : of.poles], step[2 * of.pairs :]
        later, earlier = (self.real(real + way * step, delay_s) for way in (1, -1))
        return change, (later - earlier) / (2 * step[:, np.newaxis])

    def slopes(self, moves: tuple[Complex, Complex], weights: Floats) -> Complex:
        """Derivative of the response with these weights by each nonlinear parameter but delays, (lines, poles)."""
        of = self.structure
        of_pairs = np.einsum("ipcl,pc->lpi", moves[0], weights[: 2 * of.pairs].reshape(of.pairs, 2))
        of_real = weights[2 * of.pairs : of.poles] * moves[1].T
        return np.concatenate([of_pairs.reshape(self._s.size, 2 * of.pairs), of_real], axis=1)

    def pairs(self, a1: Floats, a0: Floats, delay_s: float = 0.0) -> Complex:
        """Both columns of pairs (...), shape (..., 2, lines)."""
        none, ones, unit = np.zeros_like(a1), np.ones_like(a1), self.unit
        above = [np.stack(part, axis=-1) for part in ((none, unit * ones), (unit**2 * ones, none))]
        below = [part[..., np.newaxis] for part in (ones, a1, a0)]
        return self._at(Transfer.of(above, below), delay_s)

    def real(self, a: Floats, delay_s: float = 0.0) -> Complex:
        """The column of each real pole, shape (poles, lines)."""
        return self._at(Transfer.of([self.unit + np.zeros_like(a)], [np.ones_like(a), a]), delay_s)

    def _at(self, transfer: Transfer, delay_s: float) -> Complex:
        if self.grid.hold == "none":
            return np.asarray(transfer.response(self._s) * np.exp(-self._s * delay_s))
        return transfer.sampled(self._z, self.grid.rate_hz, delay_s)

    def _integrators_and_direct(self, delay_s: float) -> list[Complex]:
        of, late = self.structure, np.exp(-self._s * delay_s)
        integrators = [
            self._at(Transfer.of([self.unit**order], [1.0] + [0.0] * order), delay_s)[np.newaxis]
            for order in range(1, of.integrators + 1)
        ]
        return integrators + [(self._direct(order) * late)[np.newaxis] for order in range(of.direct)]

    def _direct(self, order: int) -> Complex:
        """Term 0 or 1."""
        if self.grid.hold == "none":
            return (self._s / self.unit) ** order
        return np.asarray(np.exp(-order * self._s / self.grid.rate_hz))

    def _steps(self, theta: Floats) -> Floats:
        pairs = self.structure.pairs_of(theta)
        size = np.sqrt(np.abs(pairs[:, 1])) + 1e-9 * self.unit
        both = np.stack([_STEP * size, _STEP * size**2], axis=-1).ravel()
        reals = theta[2 * self.structure.pairs : self.structure.poles]
        return np.concatenate([both, _STEP * (np.abs(reals) + 1e-3 * self.unit)])


class PoleQuantities:
    """Names, units and values of the quantities of a structure at given parameters.

    A complex pair is a mode: frequency |p|/2π, damping ratio, and at each output the residue R of the pole with the
    positive imaginary part, as size and phase: G = R/(s − p) + R*/(s − p*) + …. A real pole has a corner frequency
    −p/2π, and a residue with its sign.

    Parameters
    ----------
    structure, unit
        As of the PartialFractions.
    outputs, units
        Name of each output and unit of its response.
    like
        Parameters (size,) that decide which pairs are complex, and the order of the poles.
    """

    def __init__(
        self, structure: Structure, unit: float, outputs: tuple[str, ...], units: tuple[str, ...], like: Floats
    ) -> None:
        self._structure, self._unit = structure, unit
        a1, a0 = structure.pairs_of(like[: structure.nonlinear]).T
        order = np.argsort(np.abs(a0[: structure.modes]))
        self._modes = [int(i) for i in order if a1[i] ** 2 < 4 * a0[i]]
        self._real = [int(i) for i in order if i not in self._modes]
        modes, reals = len(self._modes), 2 * len(self._real) + structure.single
        poles = [(f"{name}_{i + 1}", of) for i in range(modes) for name, of in (("frequency", "Hz"), ("damping", ""))]
        poles += [(f"pole_{i + 1}", "Hz") for i in range(reals)]
        others = []
        for output, u in zip(outputs, units):
            per_s = f"({u})/s" if u else "1/s"
            for i in range(modes):
                others += [(f"residue_{i + 1} {output}", per_s), (f"phase_{i + 1} {output}", "°")]
            others += [(f"residue of pole_{i + 1} {output}", per_s) for i in range(reals)]
            others += [(f"1/s{'²' * (i > 0)} {output}", per_s + "²" * (i > 0)) for i in range(structure.integrators)]
            others += [(f"delay {output}", "s")] * structure.delays
        self.names, self.units = tuple(n for n, _ in poles + others), tuple(u for _, u in poles + others)
        self.certain = [i for i, name in enumerate(self.names) if name.startswith("frequency_")]
        """Positions of the frequencies, whose uncertainty decides whether the lines show the modes."""
        self._like = like

    def of(self, values: Floats) -> Floats:
        """From parameters (..., size), shape (..., names)."""
        structure, unit = self._structure, self._unit
        theta = values[..., : structure.nonlinear]
        linear = values[..., structure.nonlinear :].reshape(*values.shape[:-1], structure.outputs, structure.linear)
        pairs, (upper, lower) = structure.pairs_of(theta), self._roots(theta)
        size = np.sqrt(np.abs(pairs[..., 1]))
        single = theta[..., 2 * structure.pairs : structure.poles]
        parts = [x for i in self._modes for x in (size[..., i] / (2 * pi), pairs[..., i, 0] / (2 * size[..., i]))]
        parts += [-p[..., i].real / (2 * pi) for i in self._real for p in (upper, lower)]
        parts += list(np.moveaxis(single, -1, 0) / (2 * pi))
        delays, first = structure.delays_of(theta), self._residues(self._like, upper=True)
        for k in range(structure.outputs):
            more = linear[..., k, 2 * structure.pairs :]
            above, below = (self._residues(values, upper=way)[..., k, :] for way in (True, False))
            for i in self._modes:
                # About the phase of the fit, so that a small change does not pass ±180°.
                turned = np.angle(above[..., i] / first[k, i]) + np.angle(first[k, i])
                parts += [np.abs(above[..., i]), np.degrees(turned)]
            parts += [r[..., i].real for i in self._real for r in (above, below)]
            parts += [more[..., j] * unit for j in range(structure.single)]
            parts += [more[..., structure.single + j] * unit ** (j + 1) for j in range(structure.integrators)]
            parts += [delays[..., k]] * structure.delays
        return np.stack(parts, axis=-1) if parts else np.empty((*values.shape[:-1], 0))

    def _roots(self, theta: Floats) -> tuple[Complex, Complex]:
        """Poles of each pair, the one with the positive imaginary part first."""
        a1, a0 = np.moveaxis(self._structure.pairs_of(theta), -1, 0)
        root: Complex = np.sqrt((a1**2 / 4 - a0).astype(np.complex128))
        return np.asarray(root - a1 / 2), np.asarray(-root - a1 / 2)

    def _residues(self, values: Floats, *, upper: bool) -> Complex:
        """At one pole of each pair, (..., outputs, pairs)."""
        structure, unit = self._structure, self._unit
        theta = values[..., : structure.nonlinear]
        linear = values[..., structure.nonlinear :].reshape(*values.shape[:-1], structure.outputs, structure.linear)
        still, moving = (linear[..., j : 2 * structure.pairs : 2] for j in range(2))
        p, other = self._roots(theta) if upper else self._roots(theta)[::-1]
        p, other = p[..., np.newaxis, :], other[..., np.newaxis, :]
        return np.asarray((moving * unit * p + still * unit**2) / (p - other))
