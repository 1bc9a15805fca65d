"""Settings of a MatrixTracker: the signals, the loop, and the order of the experiments."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field
from functools import cached_property
from typing import Literal

from livebode.core import CHANNELS_MAX, Lines, MatrixLoop, UsageError
from livebode.dataclass import dataclass
from livebode.estimation import nearest_hop
from livebode.fitting import Repetitions

Method = Literal["direct", "joint", "indirect"]


@dataclass(frozen=True, kw_only=True)
class MatrixSettings:
    """How a MatrixTracker turns samples into MatrixResponses.

    The excitation is a sequence of experiments that repeats: in each of them every excitation is a multisine with the
    period `lines.window` (`MatrixExcitation` makes it). An experiment lasts `dwell` periods. Windows in its first
    `settle` periods contain the transient from the experiment before it and are not used.

    Parameters
    ----------
    lines
        Excited lines, with the window and the rate.
    output, input, excitation
        Channel names of y, u and w, up to 8 each. Direct needs y and u, joint all three, indirect y and w. Joint and
        indirect need as many excitations as inputs.
    estimator
        "direct": G = S_yu·S_uu⁻¹, biased in closed loop by noise that feedback carries into u. "joint":
        G = S_yw·S_uw⁻¹, unbiased in closed loop; with as many experiments as inputs w cancels, and only shows whether
        the experiments are different. "indirect": G = T·(E − F·T)⁻¹ with T = S_yw·S_ww⁻¹, biased by every error in the
        description of the controllers.
    loop
        The controllers, and when signals were logged.
    experiments
        Number n of different experiments before they repeat; default: as many as excitations (direct: as inputs).
    dwell, settle
        Periods of an experiment, and those of them that are not used; default: 2 and 1, and 1 and 0 of one experiment.
    start
        Number of the first sample of an experiment.
    hop
        Samples between responses, a divisor of the window; default: about a twentieth of it.
    memory
        Repetitions of all experiments that are remembered, 2 or more: those that the noise is estimated from.
    average
        Whether a response is computed from all remembered repetitions, instead of the newest n experiments.
    condition_max
        Condition number of the inputs beyond which they do not separate.

    Raises
    ------
    UsageError
        If a signal that the estimator needs is not named, numbers of signals do not fit each other, or a value is out
        of range.

    Examples
    --------
    >>> lines = Lines.parse("20:140:20", 4000, 400)
    >>> settings = MatrixSettings(lines=lines, output=["y1", "y2"], input=["u1", "u2"], excitation=["w1", "w2"])
    >>> settings.count, settings.dwell, settings.cycle
    (2, 2, 1600)
    """

    lines: Lines
    output: Sequence[str]
    input: Sequence[str] = ()
    excitation: Sequence[str] = ()
    estimator: Method = "joint"
    loop: MatrixLoop = field(default_factory=MatrixLoop)
    experiments: int | None = None
    dwell: int | None = None
    settle: int | None = None
    start: int = 0
    hop: int | None = None
    memory: int = 8
    average: bool = False
    condition_max: float = 1e3

    def __post_init__(self) -> None:
        for name in ("output", "input", "excitation"):
            given = getattr(self, name)
            object.__setattr__(self, name, (given,) if isinstance(given, str) else tuple(given))
        if self.estimator not in ("direct", "joint", "indirect"):
            raise UsageError(
                "not-one-of",
                f"estimator={self.estimator!r} is not supported for several inputs",
                "choose 'direct', 'joint' or 'indirect'",
                argument="estimator",
                value=self.estimator,
                allowed=["direct", "joint", "indirect"],
            )
        self._check_signals()
        several = self.count > 1
        for name, usual in (
            ("dwell", 2 if several else 1),
            ("settle", 1 if several else 0),
            ("hop", nearest_hop(self.lines.window, self.lines.window / 20)),
        ):
            if getattr(self, name) is None:
                object.__setattr__(self, name, usual)
        self._check_numbers()
        if self.estimator == "indirect":
            self._check_loop()

    def _check_signals(self) -> None:
        needed = {"direct": ("output", "input"), "joint": ("output", "input", "excitation")}
        for name in needed.get(self.estimator, ("output", "excitation")):
            if not 1 <= len(getattr(self, name)) <= CHANNELS_MAX:
                raise UsageError(
                    "out-of-range",
                    f"the {self.estimator} estimator has {len(getattr(self, name))} {name} signals",
                    f"name 1 to {CHANNELS_MAX} channels",
                    argument=name,
                    estimator=self.estimator,
                )
        if self.estimator == "joint" and len(self.input) != len(self.excitation):
            raise UsageError(
                "wrong-shape",
                f"there are {len(self.input)} inputs, but {len(self.excitation)} excitations",
                "name one excitation for each input",
                argument="excitation",
                inputs=len(self.input),
                excitations=len(self.excitation),
            )
        names = self.channels
        if twice := next((name for name in names if names.count(name) > 1), None):
            raise UsageError(
                "conflict",
                f"channel {twice!r} is named for two signals",
                "give each signal its own channel",
                argument="input",
                value=twice,
            )

    def _check_numbers(self) -> None:
        assert self.dwell is not None
        assert self.settle is not None
        limits = (
            ("experiments", self.count, 1, 64),
            ("dwell", self.dwell, self.settle + 1, 1000),
            ("settle", self.settle, 0, 999),
            ("memory", self.memory, 2, 1000),
            ("hop", self.step, 1, self.lines.window),
            ("start", self.start, 0, 2**62),
            ("condition_max", self.condition_max, 1, 1e12),
        )
        for name, value, low, high in limits:
            if not low <= value <= high:
                raise UsageError(
                    "out-of-range",
                    f"{name}={value} is not from {low} to {high}",
                    "choose a value between them",
                    argument=name,
                    value=value,
                    low=low,
                    high=high,
                )
        if self.lines.window % self.step:
            raise UsageError(
                "out-of-range",
                f"hop={self.step} does not divide the window of {self.lines.window} samples",
                f"take {nearest_hop(self.lines.window, self.step)}",
                argument="hop",
                value=self.step,
                window=self.lines.window,
            )

    def _check_loop(self) -> None:
        shape = self.loop.feedback_at(self.lines.frequency_hz[:1]).shape[1:]
        excitations = self.loop.entry_at(self.lines.frequency_hz[:1], shape[0]).shape[1:]
        if shape != (len(self.excitation), len(self.output)) or excitations != (shape[0], shape[0]):
            raise UsageError(
                "wrong-shape",
                f"the feedback is a matrix of {shape[0]} × {shape[1]}, and the entry of {excitations[0]} × "
                f"{excitations[1]}, for {len(self.excitation)} excitations and {len(self.output)} outputs",
                "give one row for each input and one column for each output (excitation)",
                argument="feedback",
            )

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the inputs of the response: the plant inputs; of indirect the excitations that act on them."""
        return tuple(self.excitation if self.estimator == "indirect" else self.input)

    @property
    def channels(self) -> tuple[str, ...]:
        """Channels that go through the DFT: outputs, inputs, excitations."""
        reference = () if self.estimator == "direct" else self.excitation
        return (*self.output, *(() if self.estimator == "indirect" else self.input), *reference)

    @property
    def count(self) -> int:
        """Number of experiments before they repeat."""
        if self.experiments is not None:
            return self.experiments
        return len(self.excitation) or len(self.input)

    @property
    def step(self) -> int:
        """The hop in samples, specified or default."""
        assert self.hop is not None
        return self.hop

    @property
    def span(self) -> int:
        """Samples of one experiment; of an excitation that does not change a period."""
        assert self.dwell is not None
        return self.lines.window * (self.dwell if self.count > 1 else 1)

    @property
    def noise_dof(self) -> int:
        """Complex degrees of freedom of the noise once all repetitions are there; the newest is apart without average.

        >>> lines = Lines.parse("20:140:20", 4000, 400)
        >>> MatrixSettings(lines=lines, output="y", input=["u1", "u2"], estimator="direct", memory=5).noise_dof
        6
        """
        return (self.memory - (1 if self.average else 2)) * self.count

    @property
    def noise_samples(self) -> int:
        """Samples before those of a response from which its noise is estimated; none with `average`."""
        return 0 if self.average else self.memory * self.cycle

    @property
    def cycle(self) -> int:
        """Samples after which the excitation repeats."""
        return self.span * self.count

    @property
    def repetitions(self) -> Repetitions:
        """How a test for a drift of the machine finds the repetitions in the matrices."""
        memory = self.memory if self.average else 1
        return Repetitions.of_experiments(self.lines.window, self.span, self.count, memory)

    @property
    def settled_window(self) -> int:
        """Samples of a window and of the settling before it."""
        assert self.settle is not None
        return self.lines.window * ((self.settle if self.count > 1 else 0) + 1)

    @property
    def first_place(self) -> int:
        """Samples from the begin of an experiment to the end of its first window that is used."""
        assert self.settle is not None
        earliest = (self.settle + 1) * self.lines.window if self.count > 1 else 1
        return earliest + (-(earliest + self.start)) % self.step

    @property
    def places(self) -> int:
        """Windows of one experiment that are used."""
        return (self.span - self.first_place) // self.step + 1

    @cached_property
    def identity(self) -> str:
        """All settings that a tracker's state depends on."""
        names = ("lines", "output", "input", "excitation", "estimator", "experiments", "dwell", "settle", "start")
        timing = [self.loop.timing.advance_ticks(role) for role in ("input", "excitation", "output")]
        return repr((*(getattr(self, name) for name in names), self.hop, self.memory, timing))
