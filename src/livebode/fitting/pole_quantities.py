"""From partial fractions to what a person reads: frequencies, dampings, residues, gains and delays."""

from __future__ import annotations

from math import pi

import numpy as np

from livebode.arrays import Complex, Floats
from livebode.fitting.partial_fractions import Structure


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
        order = np.argsort(np.abs(a0))
        self._modes = [int(i) for i in order if a1[i] ** 2 < 4 * a0[i]]
        self._real = [int(i) for i in order if i not in self._modes]
        modes, reals = len(self._modes), 2 * len(self._real) + structure.single
        poles = [(f"{what}_{i + 1}", of) for i in range(modes) for what, of in (("frequency", "Hz"), ("damping", ""))]
        poles += [(f"pole_{i + 1}", "Hz") for i in range(reals)]
        rest = []
        for output, u in zip(outputs, units):
            per_s = f"({u})/s" if u else "1/s"
            for i in range(modes):
                rest += [(f"residue_{i + 1} {output}", per_s), (f"phase_{i + 1} {output}", "°")]
            rest += [(f"residue of pole_{i + 1} {output}", per_s) for i in range(reals)]
            rest += [(f"1/s{'²' * (i > 0)} {output}", per_s + "²" * (i > 0)) for i in range(structure.integrators)]
            rest += [(f"delay {output}", "s")] * structure.delays
        self.names, self.units = tuple(n for n, _ in poles + rest), tuple(u for _, u in poles + rest)
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
