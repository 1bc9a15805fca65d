"""Settings of a Tracker: plain data, validated together; the three estimators of the plant."""

from __future__ import annotations

from dataclasses import field
from functools import cached_property
from math import isqrt
from typing import Literal

from livebode.core import Lines, Loop, Quantity, UsageError
from livebode.dataclass import dataclass
from livebode.estimation.ripple import RippleOrder

Role = Literal["excitation", "input", "output"]


@dataclass(frozen=True)
class Estimator:
    """The quotient S_ry/S_rd of the output y and a denominator d, both correlated with a reference r.

    Over windows i the estimate is Σ Y_i·conj(R_i) / Σ D_i·conj(R_i).
    """

    name: str
    reference: Role
    denominator: Role
    through_loop: bool = False

    @property
    def roles(self) -> tuple[Role, ...]:
        """The signals that it needs, each once; the output is first."""
        return tuple(dict.fromkeys(("output", self.denominator, self.reference)))


DIRECT = Estimator("direct", reference="input", denominator="input")
"""G = S_uy/S_uu, Nevaranta 2016, eq. (1). Biased in closed loop: feedback correlates u with the noise. Unbiased
without feedback, and for a closed-loop response whose input is the reference."""

JOINT = Estimator("joint", reference="excitation", denominator="input")
"""G = S_wy/S_wu, Nevaranta 2016, eq. (2). Unbiased in closed loop, whatever the controller does; w is the
instrument."""

INDIRECT = Estimator("indirect", reference="excitation", denominator="excitation", through_loop=True)
"""G = Gcl/(E − Gcl·F) with Gcl = S_wy/S_ww, Nevaranta 2016, eqs. (15) and (16). Needs no u, but the controllers F;
biased by every error in their description (one forgotten tick of delay is 10 % near the resonance)."""

NON_PERIODIC = ("lpm", "welch")
"""Estimators for any excitation: the local polynomial method and Welch's method. Joint where an excitation is named,
else direct; see `NonPeriodicTracker`."""

ESTIMATORS = {estimator.name: estimator for estimator in (DIRECT, JOINT, INDIRECT)}


WINDOWS = 8
"""Windows of Welch's method in the samples of one response."""
FORGETTING = 0.8
"""Default weight of a period relative to the next one: about nine periods are remembered."""
DETECTION_LINES_MIN = 4
"""Smallest number of detection lines for an estimate of the noise."""

QUANTITIES: tuple[Quantity, ...] = ("plant", "open loop", "closed loop", "sensitivity")


@dataclass(frozen=True, kw_only=True)
class Settings:
    """How a Tracker turns samples into Responses.

    Parameters
    ----------
    lines
        Excited lines, with the window and the rate.
    output, input, excitation, schedule
        Channel names of y, u, w and of the signal that responses are plotted over (position). Direct needs y and u,
        joint y, u and w, indirect y and w.
    estimator
        "direct", "joint" or "indirect"; see `ESTIMATORS` for when each is biased. For an excitation that does not
        repeat "lpm" or "welch", of a `NonPeriodicTracker`.
    loop
        The feedback, the injection point of w, and when signals were logged.
    quantity
        "plant", "open loop", "closed loop" or "sensitivity".
    hop
        Samples between responses, counted within the period; by default a twentieth of the window. Longer than the
        window only as a multiple of it; "a period before" is then a hop before, also for `forgetting`.
    average
        Whether a response is the weighted mean over the remembered periods instead of the newest window alone.
    forgetting
        λ per period, 0 < λ ≤ 1: the memory of `sigma` and coherence, and of the value when averaging.
        0.8 remembers about nine periods, 1 all.
    noise
        Where the noise in sigma comes from: "periods", the scatter between them; "quiet", the larger of that and of
        what detection lines (non-excited bins) show; "auto", the scatter between periods. Where the schedule moves,
        "auto" and "quiet" take the detection lines alone, because the scatter contains the motion.
    differenced
        Channels that are differenced before the DFT (and divided by 1 − z⁻¹ after it): a position that drifts.
    hann
        Whether lines are computed from three bins, as with a Hann window.
    spikes
        Channels that are checked for spikes; windows with a spike are excluded. See `SpikeGate`.
    dtype
        "float64", or "float32" to match the kernel on a drive without double precision: samples are rounded to it on
        arrival, and the DFT's tables and sums use it. The error grows with a constant offset on a channel.
    ripple
        Orders of a torque that repeats with the schedule, as cogging does. Where one meets a line, sigma contains it.

    Raises
    ------
    UsageError
        If a signal that the estimator needs is not named, or a number is out of range.

    Examples
    --------
    >>> settings = Settings(lines=Lines.parse("20:140:20", 4000, 400), output="y", input="u", excitation="w", hop=100)
    >>> settings.estimator, settings.quantity
    ('joint', 'plant')
    """

    lines: Lines
    output: str
    input: str | None = None
    excitation: str | None = None
    schedule: str | None = None
    estimator: str = "joint"
    loop: Loop = field(default_factory=Loop)
    quantity: Quantity = "plant"
    hop: int | None = None
    average: bool = False
    forgetting: float = FORGETTING
    noise: Literal["auto", "periods", "quiet"] = "auto"
    differenced: tuple[str, ...] = ()
    hann: bool = False
    spikes: tuple[str, ...] = ()
    dtype: Literal["float64", "float32"] = "float64"
    ripple: tuple[RippleOrder, ...] = ()

    def __post_init__(self) -> None:
        self._check_words()
        if self.hop is None:
            object.__setattr__(self, "hop", default_hop(self.span))
        window = self.span
        if self.step < 1 or (self.step > window and (self.step % window or not self.periodic)):
            raise UsageError(
                "out-of-range",
                f"hop={self.hop} is not between 1 and the "
                + (f"window of {window} samples, nor a multiple of it" if self.periodic else f"{window} samples used"),
                "choose another hop",
                argument="hop",
                value=self.hop,
                window=window,
            )
        if not 0 < self.forgetting <= 1:
            raise UsageError(
                "out-of-range",
                f"forgetting={self.forgetting} is not in 0 < λ ≤ 1",
                "take for example 0.8, which remembers about nine periods",
                argument="forgetting",
                value=self.forgetting,
                low=0,
                high=1,
            )
        for role in self.roles:
            if self.channel(role) is None:
                raise UsageError(
                    "missing",
                    f"the {self.estimator} estimator of the {self.quantity} needs the {role} signal",
                    "name its channel" + ("" if self.periodic else ", or in an open loop the excitation as input only"),
                    argument=role,
                    estimator=self.estimator,
                    quantity=self.quantity,
                )
        known = [name for role in self.roles if (name := self.channel(role))]
        for option in ("differenced", "spikes"):
            for name in getattr(self, option):
                if name not in known:
                    raise UsageError(
                        "unknown-name",
                        f"{option} names {name!r}, which is not one of the signals in use",
                        f"choose {' or '.join(known)}",
                        argument=option,
                        value=name,
                        allowed=known,
                    )
        self._check_together()
        self._check_loop()

    def _check_together(self) -> None:
        if self.ripple and self.schedule is None:
            raise UsageError(
                "missing",
                "a ripple repeats with the schedule, but no schedule is specified",
                "name the channel of the position",
                argument="schedule",
            )
        if self.hann and self.noise == "quiet":
            raise UsageError(
                "conflict",
                "a Hann window spreads the lines over the detection lines",
                "take the noise from periods",
                argument="noise",
                value="quiet",
            )

        if not self.periodic:
            self._check_without_period()

    def _check_without_period(self) -> None:
        for name, usual in (("hann", False), ("spikes", ()), ("noise", "auto"), ("dtype", "float64"), ("ripple", ())):
            if (value := getattr(self, name)) != usual:
                raise UsageError(
                    "conflict",
                    f"{name}={value!r} needs an excitation that repeats, but estimator={self.estimator!r} is for one "
                    "that does not",
                    "leave it out",
                    argument=name,
                    estimator=self.estimator,
                )

    def _check_words(self) -> None:
        if not isinstance(self.lines, Lines):
            raise UsageError(
                "unreadable",
                f"lines={self.lines!r} are not Lines",
                "give Lines.parse('20:140:20', rate_hz=…, window=…)",
                argument="lines",
            )
        for name, known in (
            ("estimator", (*ESTIMATORS, *NON_PERIODIC)),
            ("quantity", QUANTITIES),
            ("noise", ("auto", "periods", "quiet")),
            ("dtype", ("float64", "float32")),
        ):
            if (word := getattr(self, name)) not in known:
                raise UsageError(
                    "not-one-of",
                    f"{name}={word!r} is not supported",
                    f"choose {' or '.join(map(repr, known))}",
                    argument=name,
                    value=word,
                    allowed=list(known),
                )

    def _check_loop(self) -> None:
        if self.method.through_loop and self.loop.feedback is None:
            raise UsageError(
                "missing",
                "the indirect estimator needs the controllers",
                "describe the loop's feedback, or use joint",
                argument="estimator",
                estimator=self.estimator,
            )
        if self.quantity != "plant" and self.method is DIRECT and self.loop.feedback is None:
            raise UsageError(
                "missing",
                f"the {self.quantity} from the direct estimator needs the loop's feedback",
                "describe it, or use joint",
                argument="estimator",
                estimator=self.estimator,
                quantity=self.quantity,
            )

    @property
    def periodic(self) -> bool:
        """Whether the estimator needs an excitation that repeats every window."""
        return self.estimator in ESTIMATORS

    @property
    def method(self) -> Estimator:
        """The signals that are divided; of an estimator for any excitation those of joint or direct."""
        if self.periodic:
            return ESTIMATORS[self.estimator]
        return DIRECT if self.excitation is None else JOINT

    @property
    def span(self) -> int:
        """Samples that a response is computed from: the window, or with "welch" eight of them."""
        return WINDOWS * self.lines.window if self.estimator == "welch" else self.lines.window

    @property
    def step(self) -> int:
        """The hop in samples, specified or default."""
        assert self.hop is not None
        return self.hop

    @property
    def uses_detection_lines(self) -> bool:
        """Whether noise is taken from detection lines, always or where the schedule moves."""
        possible = self.schedule is not None and not self.hann and len(self.lines.quiet) >= DETECTION_LINES_MIN
        return self.noise == "quiet" or (self.noise == "auto" and possible)

    @property
    def roles(self) -> tuple[Role, ...]:
        """Signals that go through the DFT, the output first."""
        return self.method.roles

    @property
    def signals(self) -> tuple[int, int, int]:
        """Places of output, denominator and reference among the roles."""
        output, denominator, reference = map(
            self.roles.index, ("output", self.method.denominator, self.method.reference)
        )
        return output, denominator, reference

    @property
    def differenced_roles(self) -> tuple[bool, ...]:
        """Whether each of the roles' signals is differenced."""
        return tuple(self.channel(role) in self.differenced for role in self.roles)

    @property
    def advanced_ticks(self) -> tuple[int, ...]:
        """Samples by which each of the roles' signals is advanced, by the description of the loop."""
        return tuple(self.loop.advance_ticks(role) for role in self.roles)

    @cached_property  # a live axis asks for it with every commit
    def identity(self) -> str:
        """All settings that a tracker's state depends on; trackers with the same identity can exchange snapshots.

        Not the controllers, which only convert the measured response into that of the plant.
        """
        names = ("lines", "output", "input", "excitation", "schedule", "estimator", "hop", "average", "forgetting")
        options = ("noise", "differenced", "hann", "spikes", "dtype", "ripple")
        return repr((*(getattr(self, name) for name in names + options), self.advanced_ticks))

    def channel(self, role: Role) -> str | None:
        """Channel name of a signal."""
        return {"output": self.output, "input": self.input, "excitation": self.excitation}[role]


def default_hop(window: int) -> int:
    """The divisor of the window nearest to a twentieth of it (by ratio), so that all hops are equal.

    >>> default_hop(400), default_hop(2500), default_hop(2047)
    (20, 125, 89)
    """
    return nearest_hop(window, window / 20)


def quarter_hop(window: int) -> int:
    """The longest divisor of the window up to a quarter of it; if it has none near that, `default_hop`.

    A window has three quarters in common with the next one then. Their mean has the information of all samples but for
    the ends of the record, as with any shorter hop: `python -m studies.hops` measures it.

    >>> quarter_hop(400), quarter_hop(2500), quarter_hop(2047), quarter_hop(1009)
    (100, 625, 89, 50)
    """
    shortest = default_hop(window)
    return max((hop for hop in divisors(window) if shortest <= hop <= window / 4), default=shortest)


def nearest_hop(window: int, required: float) -> int:
    """The divisor of the window nearest to a hop of `required` samples (by ratio), so that all hops are equal.

    >>> nearest_hop(400, 200.0), nearest_hop(250, 100.0), nearest_hop(100, 200.0)
    (200, 125, 100)
    """
    required = min(max(1.0, required), float(window))
    nearest = min(divisors(window), key=lambda d: max(d / required, required / d))
    # A prime window has no divisor nearby; a longer last step in each period is then better.
    return nearest if max(nearest / required, required / nearest) <= 4 else round(required)


def divisors(window: int) -> list[int]:
    """All divisors, ascending.

    >>> divisors(12)
    [1, 2, 3, 4, 6, 12]
    """
    small = [d for d in range(1, isqrt(window) + 1) if window % d == 0]
    return sorted({*small, *(window // d for d in small)})
