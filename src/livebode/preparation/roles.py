"""Roles of channels: doubts from the shapes of their responses, units and names."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from itertools import combinations

import numpy as np

from livebode.arrays import Complex, Floats
from livebode.core import ANY_EXCITATION, Channel, LivebodeError, SignalError
from livebode.dataclass import dataclass
from livebode.estimation import Role, Settings
from livebode.language import Message
from livebode.preparation._role_spectra import ChannelQuantities, RoleSpectra, role_spectra

_CHANCE = 1e-3  # probability that noise alone, at any line, is taken for a signal
_LINES_MIN, _SLOPE_LINES = 4, 200  # fewer give no slope, more do not improve it
_NEPERS_FLAT = 0.2  # standard deviation of a gain over frequency that is the excitation itself
_DIRECT_DEG = 60.0  # a drive's delay in the upper half of the band
_LAG_DEG = (-150.0, -30.0)  # of a machine from torque to speed or position, with a delay


def limit(lines: int, windows: int) -> float:
    """Level that the coherence of noise over so many windows exceeds at any line with a probability of 1e-3."""
    return float(1 - (_CHANCE / lines) ** (1 / (windows - 1)))


def wide(f: Floats, factor: float) -> bool:
    """Whether there are enough lines, over a sufficient band, for a slope."""
    return bool(len(f) >= _LINES_MIN and f[-1] >= factor * f[0])


def slope(f: Floats, response: Complex | Floats) -> float:
    """d ln|response|/d ln f, the median over pairs of lines (Theil 1950, Sen 1968), which a notch affects little."""
    some = np.unique(np.linspace(0, len(f) - 1, min(len(f), _SLOPE_LINES)).astype(int))
    one, other = np.triu_indices(some.size, 1)
    at, level = np.log(f[some]), np.log(np.abs(response[some]))
    return float(np.median((level[other] - level[one]) / (at[other] - at[one])))


def mean_deg(response: Complex) -> float:
    """Mean phase, −180 … 180°."""
    return float(np.degrees(np.angle(np.mean(response / np.abs(response)))))


def direct(response: Complex) -> bool:
    """Whether a signal is a constant share of the excitation at all these lines."""
    return unevenness(response) < _NEPERS_FLAT and abs(mean_deg(response)) < _DIRECT_DEG


def unevenness(response: Complex) -> float:
    """Standard deviation of the gain over frequency, Np."""
    return float(np.std(np.log(np.abs(response))))


def lags(angle_deg: float) -> bool:
    """Whether this is the phase of a machine's output relative to its torque."""
    return _LAG_DEG[0] < angle_deg < _LAG_DEG[1]


def sized(response: Complex) -> str:
    """Phase and unevenness for people."""
    return f"{mean_deg(response):.0f}° at the upper lines, gain flat within {100 * unevenness(response):.0f} %"


ROLES: tuple[Role, ...] = ("excitation", "input", "output")
_OPEN_LOOP = "for an open loop set tracking.estimator to 'direct' and name only that input"
_ACCEPT = Message("to keep these roles, set tracking.accept_roles")
# Repeating share of a variance: all of a command, almost nothing of a moving axis.
_REPEATING_MIN, _REPEATING_USUAL = 0.1, 0.5
_WINDOWS_MIN, _PAIRS_MIN = 8, 16  # fewer cannot show noise
_RETURNING_MAX = 0.25  # of noise's power: an excitation below that is dominated by leakage
# Gain over frequency, as an exponent. A machine's gain falls, except between an antiresonance and the resonance
# above it. The width of that zone is the square root of the inertia ratio: a factor of 6 needs a ratio above 35.
_RISES, _RISES_CLEARLY, _ZONE, _ZONE_MAX = 0.15, 0.5, 3.0, 6.0
_LEADING_MAX_DEG, _RISES_AS_POSITION = 110.0, 1.2  # an exchanged velocity leads by 90° and rises with f^1
_LAGGING_MAX = 0.25  # of the lines: below such a zone and above it a machine lags
_RESPONSE_INPUT, _RESPONSE_OUTPUT, _RESPONSE_ITSELF = 1.0, 0.75, -0.75
_LOOP_DOUBTFUL, _LOOP_WRONG, _SIGMAS = 0.1, 0.5, 5.0


@dataclass(frozen=True)
class Suspicion:
    """Finding, remedy, whether it is certain, and the channels concerned."""

    message: str
    remedy: str
    certain: bool
    channels: tuple[str | None, ...]

    @property
    def sentence(self) -> str:
        """Message and remedy."""
        return Message("{message}; {remedy}", message=self.message, remedy=self.remedy)


def check_distinct(settings: Settings) -> None:
    """SignalError if two roles that the estimator distinguishes have the same channel."""
    for one, other in combinations(ROLES, 2):
        name = settings.channel(one)
        if name is None or name != settings.channel(other):
            continue
        open_loop = (one, other) == ("excitation", "input")
        if not (open_loop and settings.method.reference == "input"):
            remedy = _OPEN_LOOP if open_loop else "name another"
            raise SignalError(
                "role-shared",
                f"{name!r} is both the {one} and the {other}",
                f"{remedy}; {_ACCEPT}",
                channel=name,
                roles=[one, other],
                key="tracking.accept_roles",
            )


def suspicions(signals: Mapping[Role, Floats], settings: Settings, channels: Iterable[Channel] = ()) -> list[Suspicion]:
    """All doubts about the roles, from the beginning of a recording, by role, with NaN for missing samples.

    It detects: two roles with the same samples; an excitation that does not repeat, or that is a response of the
    machine; an input of noise; an output that is unrelated to the excitation; input and output exchanged; for the
    indirect estimator a description of the loop that contradicts the measured input. A machine whose gain rises over
    its whole band, up to six times the lowest line, cannot be distinguished from one with exchanged signals.
    """
    found = list(_copies(signals, settings))
    if not settings.periodic:
        return found
    spectra = role_spectra(signals, settings)
    if spectra is None or any(one.certain for one in found):
        return found
    quantities = ChannelQuantities(channels)
    rules: tuple[Callable[[RoleSpectra], Suspicion | None], ...] = (
        partial(_not_repeating, signal=signals.get("excitation")),
        partial(_answering_excitation, quantities=quantities),
        _noise_as_input,
        partial(_exchanged, quantities=quantities),
        _contradicting_loop,
        _without_answer,
    )
    with np.errstate(all="ignore"):  # a signal without power at a line gives NaN, which no rule rejects
        return found + [one for rule in rules if (one := rule(spectra)) is not None]


def _copies(signals: Mapping[Role, Floats], settings: Settings) -> Iterator[Suspicion]:
    for one, other in combinations([role for role in ROLES if role in signals], 2):
        if settings.channel(one) != settings.channel(other) and np.array_equal(
            signals[one], signals[other], equal_nan=True
        ):
            certain = other == "output"
            remedy = Message("correct only without feedback")
            if certain:
                remedy = Message("name the channel of the machine's output")
            both = settings.channel(one), settings.channel(other)
            message = Message(
                "{channel} ({role}) and {other} ({other_role}) have the same samples",
                channel=repr(both[0]),
                role=one,
                other=repr(both[1]),
                other_role=other,
            )
            yield Suspicion(message, Message("{remedy}; {keep}", remedy=remedy, keep=_ACCEPT), certain, both)


def _not_repeating(spectra: RoleSpectra, signal: Floats | None) -> Suspicion | None:
    settings = spectra.settings
    if settings.method.reference != "excitation" or spectra.repeating >= _REPEATING_USUAL:
        return None
    remedy = Message("name the channel of the signal that is added; {spectrum}", spectrum=ANY_EXCITATION)
    period = None if signal is None else period_of(signal, settings.lines.rate_hz)
    if period is not None and settings.lines.window % period:
        remedy = Message(
            "it repeats every {period} samples: choose a multiple of them as window (lines.window, option --window)",
            period=period,
        )
    return Suspicion(
        Message(
            "{excitation} does not repeat like an excitation: {percent:.2g} % of its variance repeats every "
            "{window} samples",
            excitation=repr(settings.excitation),
            percent=100 * max(spectra.repeating, 0.0),
            window=settings.lines.window,
        ),
        Message("{remedy}; {keep}", remedy=remedy, keep=_ACCEPT),
        spectra.repeating < _REPEATING_MIN,
        (settings.excitation,),
    )


def period_of(signal: Floats, rate_hz: float) -> int | None:
    """The period with which a signal repeats, in samples; None if it does not."""
    from livebode.excitation import recognise  # its statistics are slow to import

    try:
        return recognise(signal, rate_hz, doubtful=True).period
    except LivebodeError:
        return None


def _answering_excitation(spectra: RoleSpectra, quantities: ChannelQuantities) -> Suspicion | None:
    """A position as excitation: it falls with frequency, and the signal that should respond to it rises."""
    settings, f = spectra.settings, spectra.frequency_hz
    if settings.method.reference != "excitation" or spectra.exact or not wide(f, _ZONE):
        return None
    if quantities.drives(str(settings.excitation)):
        return None
    own = slope(f, np.sqrt(np.mean(np.abs(spectra.spectra["excitation"]) ** 2, axis=0)))
    slopes = {role: slope(f, spectra.ratio(role, "excitation")) for role in ROLES[1:] if role in spectra.spectra}
    rises_by_nature = quantities.accelerates(settings.output)
    inputs = slopes.get("input", np.inf) >= _RESPONSE_INPUT
    outputs = slopes["output"] >= _RESPONSE_OUTPUT and not rises_by_nature
    if own > _RESPONSE_ITSELF or not inputs or not (outputs or "input" in slopes):
        return None
    role: Role = "input" if "input" in slopes else "output"
    return Suspicion(
        Message(
            "{channel} looks like a response of the machine, not like an excitation: it falls with "
            "f^{slope:.1f}, and {response} over it rises with f^{rise:.1f}",
            channel=repr(settings.excitation),
            slope=own,
            response=repr(settings.channel(role)),
            rise=slopes[role],
        ),
        Message("name the channel of the signal that is added; {keep}", keep=_ACCEPT),
        outputs,
        (settings.excitation,),
    )


def _noise_as_input(spectra: RoleSpectra) -> Suspicion | None:
    settings = spectra.settings
    if settings.method.reference != "input":
        return None
    returning, pairs = spectra.returns("input")
    if pairs < _PAIRS_MIN or not np.all(returning < min(limit(len(returning), pairs), _RETURNING_MAX)):
        return None
    return Suspicion(
        Message(
            "{input} is noise at all {lines} lines: at most {percent:.2g} % of its power repeats every {window} "
            "samples, so that a window leaks",
            input=repr(settings.input),
            lines=len(returning),
            percent=100 * returning.max(),
            window=settings.lines.window,
        ),
        Message("name the excited input; {spectrum}; {keep}", spectrum=ANY_EXCITATION, keep=_ACCEPT),
        True,
        (settings.input,),
    )


def _exchanged(spectra: RoleSpectra, quantities: ChannelQuantities) -> Suspicion | None:
    """Input and output exchanged: the specified output follows the excitation, or leads the input.

    An acceleration over a force rises with f² and leads by 180° below a resonance.
    """
    settings, f = spectra.settings, spectra.frequency_hz
    if "input" not in spectra.spectra or settings.input is None or not wide(f, _ZONE):
        return None
    if quantities.accelerates(settings.output):
        return None
    plant = spectra.ratio("output", "input")
    rising = slope(f, plant)
    leading = bool(np.mean([lags(one) for one in np.degrees(np.angle(plant))]) < _LAGGING_MAX)
    shown = None
    if "excitation" in spectra.spectra:
        output, input_ = _upper(spectra, "output"), _upper(spectra, "input")
        if direct(input_) and not direct(output):
            return None
        follows = direct(output) and not direct(input_)
        if follows and (lags(mean_deg(input_)) or rising > _RISES):
            shown = Message(
                "{output} is a share of the excitation {excitation} ({output_share}), {input} is not ({input_share})",
                output=repr(settings.output),
                excitation=repr(settings.excitation),
                output_share=sized(output),
                input=repr(settings.input),
                input_share=sized(input_),
            )
            certain = leading or lags(mean_deg(input_))
    known = quantities.drives(settings.input) and quantities.moves(settings.output)
    if shown is None and not known and rising > _RISES and not lags(mean_deg(plant)):
        shown = Message(
            "the output leads the input by {lead_deg:.0f}° on average, and the gain rises with f^{power:.2g}",
            lead_deg=mean_deg(plant) % 360,
            power=rising,
        )
        # An inverted output between antiresonance and resonance leads by more than 90° too.
        inverted = mean_deg(plant) % 360 > _LEADING_MAX_DEG and rising < _RISES_AS_POSITION
        contradicted = quantities.moves(settings.input) or quantities.drives(settings.output)
        certain = rising > _RISES_CLEARLY and leading and wide(f, _ZONE_MAX) and not inverted and contradicted
    if shown is None:
        return None
    message = Message(
        "{input} as input and {output} as output look exchanged: {why}",
        input=repr(settings.input),
        output=repr(settings.output),
        why=shown,
    )
    remedy = Message("exchange them; {keep}", keep=_ACCEPT)
    return Suspicion(message, remedy, certain, (settings.input, settings.output))


def _upper(spectra: RoleSpectra, role: Role) -> Complex:
    """Response from the excitation at the plant input to a signal, at the upper half of the lines."""
    entry = spectra.settings.loop.entry_at(spectra.frequency_hz)
    return np.asarray(spectra.ratio(role, "excitation") / entry)[len(entry) // 2 :]


def _contradicting_loop(spectra: RoleSpectra) -> Suspicion | None:
    """Joint against indirect: their quotient is (E·W − F·Y)/U, 1 if the description of the loop is correct."""
    settings, f = spectra.settings, spectra.frequency_hz
    if "input" not in spectra.spectra or not settings.method.through_loop:
        return None
    w, u, y = (spectra.spectra[role] for role in ROLES)
    described = settings.loop.entry_at(f) * w - settings.loop.feedback_at(f) * y
    reference = w.conj()
    measured = np.sum(u * reference, axis=0)
    quotient = np.sum(described * reference, axis=0) / measured
    rest = np.abs(described - quotient * u) ** 2 * np.abs(w) ** 2
    sigma = np.sqrt(np.sum(rest, axis=0)) / np.abs(measured)
    away = np.where(np.abs(quotient - 1) > _SIGMAS * sigma, np.abs(quotient - 1), 0.0)
    worst = int(np.nanargmax(away)) if np.isfinite(away).any() else 0
    if not away[worst] > _LOOP_DOUBTFUL:
        return None
    return Suspicion(
        Message(
            "the description of the loop contradicts {input}: at {line_hz:g} Hz it predicts {times:.3g} times "
            "the measured input, so the indirect estimate is off by that",
            input=repr(settings.input),
            line_hz=f[worst],
            times=abs(quotient[worst]),
        ),
        Message(
            "check the gains in [loop], which are in SI units, or set tracking.estimator to 'joint'; {keep}",
            keep=_ACCEPT,
        ),
        bool(away[worst] > _LOOP_WRONG),
        (settings.input,),
    )


def _without_answer(spectra: RoleSpectra) -> Suspicion | None:
    """An output, or an input, that is unrelated to the reference: possible with correct roles, but useless."""
    if spectra.windows < _WINDOWS_MIN:
        return None
    chance = limit(len(spectra.frequency_hz), spectra.windows)
    for role in ("input", "output"):
        if role not in spectra.spectra or role == spectra.settings.method.reference:
            continue
        coherence = spectra.coherence(role)
        if np.all(coherence < chance):
            reference = spectra.settings.channel(spectra.settings.method.reference)
            return Suspicion(
                Message(
                    "{channel} ({role}) does not respond to {reference} at any line: their coherence over {windows} "
                    "windows is at most {coherence:.2g}",
                    channel=repr(spectra.settings.channel(role)),
                    role=role,
                    reference=repr(reference),
                    windows=spectra.windows,
                    coherence=coherence.max(),
                ),
                Message("name another channel, or raise the amplitude"),
                False,
                (spectra.settings.channel(role),),
            )
    return None


def check_roles(
    signals: Mapping[Role, Floats], settings: Settings, channels: Iterable[Channel], *, accepted: bool
) -> list[str]:
    """Doubts as sentences; SignalError if one is certain, except if the roles are `accepted`."""
    found = suspicions(signals, settings, channels)
    certain = [one for one in found if one.certain]
    if certain and not accepted:
        worst = certain[0]
        raise SignalError(
            "role-wrong",
            worst.message,
            worst.remedy,
            channels=[name for name in worst.channels if name],
            key="tracking.accept_roles",
        )
    return [one.sentence for one in found]
