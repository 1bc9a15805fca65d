"""The description of a loop compared with its signals: as described, or the single change that explains them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal

import numpy as np

from livebode.configuration import LoopSection
from livebode.core import INTERVAL_FACTOR, Loop
from livebode.dataclass import dataclass
from livebode_control.loop_check.loop_changes import LoopChange, single_changes
from livebode_control.loop_check.loop_equation import LoopResidual, LoopSignals
from livebode_control.loop_check.loop_images import held_paths

LoopVerdict = Literal["as described", "one change", "not explained"]

ALPHA = 0.002
"""Probability of each of the two tests that a true description is not found to be as described."""
HARMLESS = 5e-4
"""Share of the signals, and relative change of a number, that is below the accuracy of any description."""
_ALIKE = 10.0  # of twice the log-likelihood: odds of 150 to 1
_STEPS_MAX = 25  # of the search for a value


@dataclass(frozen=True, eq=False)
class Explanation:
    """A change of the description, and how well the signals follow it.

    Attributes
    ----------
    change
        What is changed.
    value, bound_95
        The value of its key that fits best; the bound is None for a word.
    residual
        Remainder of the equation with this change.
    p
        Probability of a larger remainder if the changed description is true.
    """

    change: LoopChange
    value: object
    bound_95: float | None
    residual: LoopResidual
    p: float

    @property
    def score(self) -> float:
        """Deviance with a penalty for a fitted number; less is better."""
        return self.residual.deviance + (0.0 if self.bound_95 is None else float(np.log(2 * self.residual.value.size)))

    @property
    def sentence(self) -> str:
        """The change, in the words of the configuration."""
        if self.bound_95 is not None:
            unit = f" {self.change.unit}" if self.change.unit else ""
            number = f"{self.value:.6g} ± {self.bound_95:.2g}{unit}"
            return f"{self.change.key} = {number} (described: {_text(self.change.described)})"
        return f"{self.change.key} = {_text(self.value)} (described: {_text(self.change.described)})"

    def plain(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "kind": self.change.kind,
            "key": self.change.key,
            "described": self.change.described,
            "value": self.value,
            "bound_95": self.bound_95,
            "p": self.p,
            "misfit": self.residual.misfit,
        }


@dataclass(frozen=True, eq=False)
class LoopCheck:
    """Result of a check.

    Attributes
    ----------
    residual
        Remainder of the equation as described.
    p
        Probability of a larger one if the description is true.
    explanations
        Changes that fit as well as the best one, the best first; the signals do not tell them apart. Empty if the loop
        is as described.
    nearest
        The change that explains most, if none explains all and the rest is not harmless.
    harmless
        Whether the signals differ from the description significantly, but by less than 0.05 %: no single word explains
        it, or a number does that changes by less than this.
    windows
        Number of windows.
    """

    residual: LoopResidual
    p: float
    explanations: tuple[Explanation, ...]
    nearest: Explanation | None
    harmless: bool
    windows: int

    @property
    def verdict(self) -> LoopVerdict:
        if self.explanations:
            return "one change"
        return "as described" if self.nearest is None else "not explained"

    @property
    def largest(self) -> tuple[float, float, float]:
        """Largest |measured/described − 1| of the controller, its bound (95 %), and the line in Hz; NaN if unknown."""
        away = np.abs(self.residual.ratio - 1)
        if not np.isfinite(away).any():
            return np.nan, np.nan, np.nan
        index = int(np.nanargmax(away))
        bound = float(np.sqrt(-np.log(0.05)) * self.residual.ratio_sigma[index])
        return float(away[index]), bound, float(self.residual.frequency_hz[index])

    @property
    def sentence(self) -> str:
        """The verdict."""
        if self.verdict == "as described":
            count = self.residual.value.size
            if self.harmless:
                return f"loop checked: as described, within {100 * HARMLESS:g} % of the signals at {count} lines"
            return f"loop checked: as described (p = {self.p:.2g}, {count} lines)"
        away, bound, at_hz = self.largest
        size = f"the controller differs by {100 * away:.3g} ± {100 * bound:.2g} % at {at_hz:g} Hz"
        if np.isnan(away):
            size = "the path of the excitation differs"
        if self.verdict == "not explained":
            return f"the check found: {size}, and no single change of the description explains it"
        others = len(self.explanations) - 1
        also = f", or one of {others} other changes that cannot be told apart" if others > 1 else ""
        if others == 1:
            also = f", or {self.explanations[1].sentence}: the two cannot be told apart with these lines"
        return f"the check found: {self.explanations[0].sentence}{also}"

    def plain(self) -> dict[str, Any]:
        """For JSON."""
        away, bound, at_hz = self.largest
        r = self.residual
        return {
            "verdict": self.verdict,
            "sentence": self.sentence,
            "p": self.p,
            "largest_difference": {"relative": away, "bound_95": bound, "frequency_hz": at_hz},
            "explanations": [explanation.plain() for explanation in self.explanations],
            "nearest": None if self.nearest is None else self.nearest.plain(),
            "windows": self.windows,
            "lines": [
                {"frequency_hz": float(f), "ratio_re": float(q.real), "ratio_im": float(q.imag), "sigma": float(s)}
                for f, q, s in zip(r.frequency_hz, r.ratio, r.ratio_sigma)
            ],
        }


def check_loop(signals: LoopSignals, section: LoopSection) -> LoopCheck:
    """Compare the described loop with the signals.

    The equation u = E·w − F·y is exact for a linear controller that computes u from the recorded y, so noise, load,
    cogging and the resolution of the encoder cancel: only noise in the recorded u, and a reference that moves, remain,
    and their scatter from window to window gives the bounds. What a controller at a lower rate folds onto the lines is
    part of the equation. The test is biased where the signals were filtered after the controller used them, or u is
    limited.

    Two tests find a wrong description: the remainder is larger than noise, or a single word explains the signals so
    much better that chance does it with a probability of at most `ALPHA` (a likelihood ratio of k by chance has a
    probability of at most 1/k; Royall, J. American Statistical Association 95(451), 2000).

    Parameters
    ----------
    signals
        Spectra of input, excitation and output.
    section
        The description, `[loop]`.

    Raises
    ------
    UsageError
        If the description has no controller.
    ConfigError
        If its rates are not that of the signals.
    """
    described = section.described(signals.lines.rate_hz)
    residual = min(
        (signals.judge(described, phase) for phase in _phases(described)), key=lambda residual: residual.deviance
    )
    windows = round(signals.dof * (1 + 2 / 36) + 1)
    p = residual.p()
    changes = single_changes(section, signals.lines.rate_hz)
    # A controller at another rate has many phases: that is tried only where the description does not fit.
    late = [change for change in changes if change.starts or change.kind == "rate"]
    words = [_explained(signals, change) for change in changes if change not in late]
    if p >= ALPHA and not _much_better(words, residual):
        return LoopCheck(residual, p, (), None, False, windows)
    tried = words + [_explained(signals, change) for change in late]
    tried.sort(key=lambda change: round(change.score, 6))  # two names of the same change: in the order of the list
    fitting = [change for change in tried if change.p >= ALPHA]
    if not fitting and residual.share < HARMLESS:
        return LoopCheck(residual, p, (), None, True, windows)
    fitting = fitting or [change for change in tried if change.residual.share < HARMLESS]
    if not fitting:
        return LoopCheck(residual, p, (), tried[0], False, windows)
    best = fitting[0]
    if _changes_little(best):
        return LoopCheck(residual, p, (), None, True, windows)
    # Where a harmless rest remains, all misfits are larger by what it adds.
    excess = max(1.0, best.residual.misfit / (2 * best.residual.value.size))
    alike = tuple(change for change in fitting if change.score - best.score < _ALIKE * excess)
    return LoopCheck(residual, p, alike, None, False, windows)


def _much_better(words: list[Explanation], described: LoopResidual) -> bool:
    """Whether one of these words explains the signals so much better that it is not by chance."""
    best = min((word.residual.deviance for word in words), default=np.inf)
    return bool(described.deviance - best > 2 * np.log(len(words) / ALPHA))


def _changes_little(best: Explanation) -> bool:
    """Whether it changes a described number by less than its accuracy."""
    described, value = best.change.described, best.value
    if best.bound_95 is None or not isinstance(described, float) or not isinstance(value, float):
        return False
    return bool(abs(value - described) < HARMLESS * abs(described))


def _explained(signals: LoopSignals, change: LoopChange) -> Explanation:
    rate_hz = signals.lines.rate_hz

    def loop(value: object) -> Loop:
        return change.apply(value).build(rate_hz)

    def judged(phase: int) -> Callable[[float], LoopResidual]:
        return lambda value: signals.judge(loop(value), phase)

    if not change.starts:
        changed_loop = loop(change.word)
        residual = min(
            (signals.judge(changed_loop, phase) for phase in _phases(changed_loop)),
            key=lambda residual: residual.deviance,
        )
        return Explanation(change, change.word, None, residual, residual.p())
    fits = []
    for start in change.starts:
        # The number hardly depends on the phase: it is fitted with the first one, and again with the best.
        value, _, _ = _fitted(judged(0), start, change.least)
        phase = min(_phases(loop(start)), key=lambda phase: judged(phase)(value).deviance)
        fits.append(_fitted(judged(phase), value, change.least))
    value, sigma, residual = min(fits, key=lambda fit: fit[2].deviance)
    return Explanation(change, value, INTERVAL_FACTOR * sigma, residual, residual.p(fitted=1))


def _phases(loop: Loop) -> range:
    """Ticks at which a controller at a lower rate may read its input first; the recording does not contain which."""
    return range(max((path.samples.rate_divider for path in held_paths(loop.feedback)), default=1))


def _fitted(judged: Callable[[float], LoopResidual], start: float, least: float) -> tuple[float, float, LoopResidual]:
    """The number with the least misfit, its sigma, and the remainder: Gauss–Newton steps, halved while they fail."""
    value, residual = start, judged(start)
    step = 1e-5 * (abs(start) or 1.0)
    sigma = float("nan")
    for _ in range(_STEPS_MAX):
        slope = (judged(value + step).value - residual.value) / step
        # A line far from zero counts as in the misfit, whose derivative this is.
        weight = 2 / (residual.variance + np.abs(residual.value) ** 2 / residual.dof)
        curvature = float(np.sum(weight * np.abs(slope) ** 2))
        if not curvature > 0:
            break
        sigma = curvature**-0.5
        move = -float(np.sum(weight * (np.conj(slope) * residual.value).real)) / curvature
        for _ in range(12):
            trial = max(value + move, least)
            trial_residual = judged(trial)
            if trial_residual.misfit < residual.misfit:
                break
            move /= 2
        else:
            break
        done = abs(trial - value) < 1e-3 * sigma
        value, residual = trial, trial_residual
        if done:
            break
    return value, sigma, residual


def _text(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else f'"{value}"' if isinstance(value, str) else str(value).lower()
