"""Validation of a fitted model on independent data."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from livebode.arrays import Floats
from livebode.core import Block, Loop, SignalError, same_rate
from livebode.dataclass import dataclass
from livebode.fitting import Fit
from livebode.language import Message
from livebode_control.validation.correlation import SMALL, Correlation, correlation, own_correlation
from livebode_control.validation.simulation import SimulatedOutput, simulate

Verdict = Literal["passes", "small error", "fails", "cannot be judged"]

_ALPHA = 0.03  # complement of 97 %


@dataclass(frozen=True, eq=False)
class Validation:
    """Result of the validation of one model.

    Attributes
    ----------
    model
        Its name.
    samples
        L, the number of samples used.
    fit_percent
        100·(1 − |ε|/|y|), norms over the samples, without start, offset and drift in either.
    residual_sigma
        Root mean square of ε, unit of the output.
    whiteness
        Probability that a white residual's autocorrelation is as large (Ljung–Box over the same lags).
    correlations
        With u, ŷ and, where the excitation is known, w.
    judged_by
        Names of the correlations that decide the verdict.
    simulated, measured, rate_hz, output
        For the picture; `output` is the channel's name with its unit.
    integrators
        Of the model.
    """

    model: str
    samples: int
    fit_percent: float
    residual_sigma: float
    whiteness: float
    correlations: tuple[Correlation, ...]
    judged_by: tuple[str, ...]
    simulated: SimulatedOutput
    measured: Floats
    rate_hz: float
    output: str
    integrators: int = 0

    @property
    def drifts(self) -> bool:
        """Whether the simulation cannot judge the model, because the residual is not smaller than the output."""
        return self.fit_percent <= 0

    @property
    def why_lines(self) -> str:
        """Why such a model is judged at the lines, as text."""
        words = {0: "", 1: " of an integrator", 2: " of two integrators"}[self.integrators]
        return f"the simulation{words} drifts from the recording (fit {self.fit_percent:.0f} %)"

    @property
    def verdict(self) -> Verdict:
        """The verdict from the correlations, their size and the fit.

        "passes": no significant correlation; "small error": a significant one, but the model misses less than a tenth
        of the output due to the driving signal; "fails": it misses more, and more than chance or the rest of the
        residual explain; "cannot be judged": neither, or the residual is as large as the output, or an error as large
        as the output due to the driving signal would not have been detected.
        """
        counted, by = self._counted, self.driven_by
        significant = any(c.p < _ALPHA / len(counted) for c in counted)
        large = significant and by.missed >= SMALL
        if self.drifts:
            return "cannot be judged"
        if large and by.missed >= by.resolution:
            return "fails"
        if large or by.resolution >= 1:
            return "cannot be judged"
        return "small error" if significant else "passes"

    @property
    def sentence(self) -> Message:
        """The verdict as text."""
        by = self.driven_by
        why: dict[str, Message] = {
            Message("passes"): Message(
                "the residual does not follow the signals, and missing {share} of what follows {signal} would have "
                "been detected",
                share=_percent(by.resolution),
                signal=by.name,
            ),
            Message("small error"): Message(
                "the model misses {share} of what follows {signal}, less than a tenth",
                share=_percent(by.missed),
                signal=by.name,
            ),
            Message("fails"): Message(
                "the model misses {share} of what follows {signal}: it is incomplete or belongs to another machine",
                share=_percent(by.missed),
                signal=by.name,
            ),
            Message("cannot be judged"): self._why_not,
        }
        sentence = Message(
            "{model} {verdict}: {why} (fit {fit_percent:.1f} %)",
            model=self.model,
            verdict=Message(self.verdict),
            why=why[self.verdict],
            fit_percent=self.fit_percent,
        )
        if self.doubtful and self.verdict in ("small error", "fails"):
            return Message(
                "{result}; in a loop, coloured noise alone can cause this: specify the excitation to be sure",
                result=sentence,
            )
        return sentence

    @property
    def driven_by(self) -> Correlation:
        """The correlation with w where it is known, else with u."""
        return next((c for c in self.correlations if c.name == "w"), self.correlations[0])

    @property
    def _why_not(self) -> Message:
        if self.drifts:
            return Message(
                "the residual is not smaller than the output: the model belongs to another machine, or friction, "
                "drift, motion or noise dominates this recording; keep the machine at standstill or increase the "
                "excitation"
            )
        by = self.driven_by
        return Message(
            "with this noise, or parameters this uncertain, only missing {seen} of what follows {signal} can be "
            "detected, and {missed} is missed; increase the excitation, record longer or fit a longer run",
            seen=_percent(by.resolution),
            signal=by.name,
            missed=_percent(by.missed),
        )

    @property
    def doubtful(self) -> bool:
        """Whether a residual that is not white was judged by u and ŷ: in a loop these may then reject a true model."""
        return self.whiteness < _ALPHA and "w" not in self.judged_by

    @property
    def _counted(self) -> list[Correlation]:
        return [c for c in self.correlations if c.name in self.judged_by]

    def plain(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "model": self.model,
            "verdict": self.verdict,
            "sentence": self.sentence,
            "samples": self.samples,
            "fit_percent": self.fit_percent,
            "residual_sigma": self.residual_sigma,
            "whiteness_p": self.whiteness,
            "doubtful": self.doubtful,
            "driven_by": self.driven_by.name,
            "missed": self.driven_by.missed,
            "resolution": self.driven_by.resolution,
            "judged_by": list(self.judged_by),
            "correlations": [
                {
                    "with": c.name,
                    "inside": c.share,
                    "inside_white_limit": c.white_share,
                    "white_limit": c.white_limit,
                    "largest": c.largest,
                    "p": c.p,
                    "lags": c.lags.tolist(),
                    "value": c.value.tolist(),
                    "limit": c.limit.tolist(),
                    "judged": c.judged.tolist(),
                }
                for c in self.correlations
            ],
        }


def validate(
    fit: Fit,
    block: Block,
    *,
    input: str,
    output: str,
    excitation: str | None = None,
    loop: Loop | None = None,
    lags: int = 40,
) -> Validation:
    """Validate a fit with samples that it was not fitted to.

    The model is driven by the recorded u; the residual ε = y − ŷ is correlated with u, with ŷ and, where it is known,
    with the excitation w. In a loop u and ŷ contain earlier noise: they are correlated with ε at lags at which ε is
    earlier, in every healthy loop, and if ε is not white at the others too. So for u and ŷ only lags from 1 on are
    judged; the excitation is independent of the noise, so all its lags are judged.

    A white residual is judged by u, ŷ and w, one that is not by w alone where it is known.

    Bias: parameters of a machine that moves or changes during `block` are not constant, and the verdict is then of
    their mean.

    Parameters
    ----------
    fit
        Of other data; its covariance widens the limits.
    block
        Independent samples, without gaps and non-finite numbers.
    input, output, excitation
        Names of its channels.
    loop
        Gives the ticks between the logging of the signals; the normal record by default.
    lags
        Largest lag on both sides.

    Raises
    ------
    SignalError
        If the block's rate is not that of the fit, it is too short or not finite, or a signal is constant.
    FitError
        If the fit failed.
    """
    if not same_rate(block.rate_hz, fit.rate_hz):
        raise SignalError(
            "rate-differs",
            f"the model was fitted at {fit.rate_hz:g} Hz, and the recording has {block.rate_hz:g} Hz",
            "record at the rate of the model",
            rate_hz=block.rate_hz,
            fit_rate_hz=fit.rate_hz,
        )
    loop = loop or Loop()
    names = {"input": input, "output": output} | ({"excitation": excitation} if excitation else {})
    signals = _aligned({role: block[name] for role, name in names.items()}, loop)
    count = len(signals["input"])
    _check(signals, names, count, lags)
    simulated = simulate(fit, signals["input"], signals["output"])
    signals = {role: x[simulated.known] for role, x in signals.items()}
    matrix, measured = _correlated(fit), simulated.without(signals["output"])
    given = [("u", signals["input"], 1), ("ŷ", simulated.output, 1)]
    if excitation:
        given.append(("w", signals["excitation"], -lags))
    correlations = tuple(
        correlation(name, simulated.residual, measured, simulated.without(x), lags, simulated.slopes, matrix, first)
        for name, x, first in given
    )
    _, whiteness = own_correlation(simulated.residual, lags)
    by = ("w",) if excitation and whiteness < _ALPHA else tuple(c.name for c in correlations)
    return Validation(
        model=fit.model.name,
        samples=len(signals["output"]),
        fit_percent=100 * (1 - float(np.linalg.norm(simulated.residual) / np.linalg.norm(measured))),
        residual_sigma=float(np.sqrt(np.mean(simulated.residual**2))),
        whiteness=whiteness,
        correlations=correlations,
        judged_by=by,
        simulated=simulated,
        measured=signals["output"],
        rate_hz=block.rate_hz,
        integrators=fit.model.continuous(fit.parameters.value[0]).integrators,
        output=f"{output} in {unit}" if (unit := next(c.unit for c in block.channels if c.name == output)) else output,
    )


def _percent(share: float) -> Message:
    if share < 0.995:
        return Message("{percent:.2g} %", percent=100 * share)
    return Message("{percent:.0f} %", percent=100 * share)


def _aligned(signals: dict[str, Floats], loop: Loop) -> dict[str, Floats]:
    """Align the signals, so that all samples with one index refer to the same tick."""
    ahead = {role: loop.advance_ticks(role) for role in signals}  # type: ignore[arg-type]
    least, most = min(ahead.values()), max(ahead.values())
    return {role: x[ahead[role] - least : len(x) - (most - ahead[role])] for role, x in signals.items()}


def _correlated(fit: Fit) -> Floats:
    """Correlation matrix of the fit's parameters, zero for fixed ones."""
    sigma = fit.parameters.sigma[0]
    unit = np.where(sigma > 0, sigma, 1.0)
    return np.asarray(fit.parameters.covariance[0] / np.outer(unit, unit))


def _check(signals: dict[str, Floats], names: dict[str, str], count: int, lags: int) -> None:
    """Raise SignalError for signals that cannot validate a model."""
    if count < 10 * lags:
        raise SignalError(
            "too-short",
            f"{count} samples are too few for {lags} lags",
            f"give at least {10 * lags} in a row",
            samples=count,
            samples_min=10 * lags,
        )
    for role, x in signals.items():
        if not np.isfinite(x).all():
            raise SignalError(
                "not-finite",
                f"channel {names[role]!r} has samples that are not finite",
                f"give at least {10 * lags} finite ones in a row",
                channel=names[role],
                role=role,
            )
    for role, x in signals.items():
        if np.ptp(x) == 0:
            raise SignalError(
                "channel-constant",
                f"channel {names[role]!r} is constant, so it cannot validate a model",
                "record it while the excitation is on",
                channel=names[role],
                role=role,
            )
