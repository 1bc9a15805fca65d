"""Fig. 14: the residual of the fitted model on independent data, and the coverage of its limits."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from scipy import signal

from livebode import Block, Lines, Response, Settings, Tracker, multisine
from livebode.fitting import Fit, fit
from livebode.simulation import TwoMassLoop, TwoMassPlant
from livebode.simulation.two_mass_loop import RATE_HZ
from livebode_control.validation.validation import Validation, validate
from studies.common import SIGMA, Floats
from studies.drawing import LIGHT, figure_of
from studies.result import Result, Study, Table, Verdict

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SAMPLES, LAGS = 3000, 40
FITTED_SAMPLES = 20_000
RUNS, SHORT = 1000, 20
BEFORE = 1000  # samples of each run that are left out: its noise's start
LINES = Lines.parse("20:140:20", RATE_HZ, 400)
EXCITATION = multisine(LINES)
WEAK = 0.02
OF_THE_PAPER = 0.15
PROMISED = 0.97
PAPER = (
    "cross-correlation of the residual with u and with ŷ on independent data, L = 3000, lags ±40; limits 2.17/√L and "
    "0.15."
)


def runs(count: int, seed: int, amplitude: float = 1.0, colour: float = 0.0, samples: int = SAMPLES) -> Floats:
    """w, u, y of as many runs of the closed loop at standstill, shape (runs, 3, samples)."""
    rng, total = np.random.default_rng(seed), samples + BEFORE
    noise = signal.lfilter([np.sqrt(1 - colour**2)], [1, -colour], rng.standard_normal((total, count)), axis=0) * SIGMA
    w = amplitude * EXCITATION
    u, y = TwoMassLoop().under(w, noise)
    return np.stack([np.broadcast_to(np.resize(w, total), u.shape), u, y], axis=1)[..., BEFORE:]


@cache
def true_model(stiffness: float = 1.0) -> Fit:
    """Two masses with the machine's own parameters, or with a wrong stiffness."""
    lines = Lines.parse("20:140:5", RATE_HZ, 800)
    value, ones = TwoMassPlant(keff=TwoMassPlant().keff * stiffness).response(lines.frequency_hz), np.ones(len(lines))
    exact = Response(lines, value, 1e-6 * ones, np.inf, ones, ones > 0, 0, 799, 0.1)
    return fit(exact, "two-mass", radius_m=0.019)


def fitted_models(count: int) -> list[Fit]:
    """The same fitted to other runs, as the tracker saw them."""
    settings = Settings(lines=LINES, excitation="w", input="u", output="y", average=True, forgetting=1.0)
    blocks = (Block(columns, ("w", "u", "y"), RATE_HZ) for columns in runs(count, 4, samples=FITTED_SAMPLES))
    return [fit(Tracker(settings).process(block)[-1], "two-mass", radius_m=0.019) for block in blocks]


def judge(model: Fit, columns: Floats) -> Validation:
    return validate(model, Block(columns, ("w", "u", "y"), RATE_HZ), input="u", output="y", excitation="w", lags=LAGS)


def shares(found: list[Validation]) -> dict[str, float]:
    """Share of lags inside, over all runs: by signal, side and limit."""
    after, before = slice(LAGS + 1, None), slice(0, LAGS + 1)
    parts = {"u, lags ≥ 1": (0, after), "u, lags ≤ 0": (0, before), "ŷ, lags ≥ 1": (1, after),
             "ŷ, lags ≤ 0": (1, before), "w": (2, slice(None))}  # fmt: skip
    by_signal = list(zip(*(v.correlations for v in found)))
    inside = {
        name: float(np.mean([np.abs(c.value[at]) <= c.limit[at] for c in by_signal[i]]))
        for name, (i, at) in parts.items()
    }
    plain = {
        f"{name}, 2.17/√L": float(
            np.mean([np.abs(c.value[at]) <= c.white_limit for c in (v.correlations[i] for v in found)])
        )
        for name, (i, at) in parts.items()
        if name in ("u, lags ≥ 1", "ŷ, lags ≥ 1", "w")
    }
    return inside | plain


def measure(short: bool = False) -> Result:
    count = SHORT if short else RUNS
    strong, weak = runs(count, 1), runs(count, 2, WEAK)
    coloured = runs(count, 3, WEAK, colour=0.7)
    fits = fitted_models(count // 10)
    cases = {
        "true model": [judge(true_model(), c) for c in strong],
        "true model, 2 % of the excitation": [judge(true_model(), c) for c in weak],
        "true model, 2 % of the excitation, coloured noise": [judge(true_model(), c) for c in coloured],
        "fitted to another run": [judge(fits[i // 10], c) for i, c in enumerate(strong)],
        "Keff 1 % wrong": [judge(true_model(1.01), c) for c in strong[: count // 5]],
        "Keff 10 % wrong": [judge(true_model(1.1), c) for c in strong[: count // 5]],
    }
    found = {name: shares(validations) for name, validations in cases.items()}
    rows = [(name, *(100 * x for x in share.values())) for name, share in found.items()]
    words = ("passes", "small error", "fails", "cannot be judged")
    verdicts = [(name, *(100 * np.mean([v.verdict == w for v in vs]) for w in words)) for name, vs in cases.items()]
    tables = [
        Table(f"Share of lags inside the limit, %, {count} runs", ("model", *found["true model"]), rows),
        Table("Verdicts, % of the runs", ("model", *words), verdicts),
    ]
    curves = {"true": cases["fitted to another run"][0], "wrong": cases["Keff 10 % wrong"][0]}
    return Result(tables, _verdicts(cases, found), curves)


def _verdicts(cases: dict[str, list[Validation]], found: dict[str, dict[str, float]]) -> list[Verdict]:
    def off(case: str, *names: str) -> float:
        return float(100 * max(abs(found[case][name] - PROMISED) for name in names))

    def share(case: str, word: str) -> float:
        return float(100 * np.mean([v.verdict == word for v in cases[case]]))

    white = ("u, lags ≥ 1", "ŷ, lags ≥ 1", "w")
    plain = tuple(f"{name}, 2.17/√L" for name in white)
    noisy, coloured, other = (
        "true model, 2 % of the excitation",
        "true model, 2 % of the excitation, coloured noise",
        "fitted to another run",
    )
    why = "too few runs, or the limit is wrong"
    wide = "the bounds of a fit also contain the choice of its model (fits.md), so the widened limit is too wide"
    fails = share("Keff 10 % wrong", "fails")
    return [
        Verdict(
            "true model, white residual, 2.17/√L: difference from 97 % inside, points",
            off("true model", *plain),
            1.0,
            why=why,
        ),
        Verdict("the same with noise much stronger than the excitation", off(noisy, *plain), 1.0, why=why),
        Verdict("coloured residual, w, widened limit: difference from 97 %, points", off(coloured, "w"), 1.0, why=why),
        Verdict(
            "fitted to another run, widened limit: difference from 97 %, points", off(other, *white), 1.0, why=wide
        ),
        Verdict("true models that pass, %", share("true model", "passes"), 96.0, at_least=True, why=why),
        Verdict("fitted models that pass, %", share(other, "passes"), 96.0, at_least=True, why=why),
        Verdict("models with Keff 10 % wrong that fail, %", fails, 99.0, at_least=True, why=why),
    ]


def draw(result: Result) -> Figure:
    facts = f"L = {SAMPLES} at {RATE_HZ / 1000:g} kHz, noise {SIGMA} rad/s; dashed: 2.17/√L; dotted: 0.15; band: 97 %"
    with figure_of("Fig. 14: the residual on independent data", facts, (11.0, 5.6)) as figure:
        panels = figure.subplots(2, 2, sharex=True)
        for row, (name, found) in zip(panels, result.curves.items()):
            for axes, c in zip(row, found.correlations[:2]):
                _panel(axes, c, "two masses fitted" if name == "true" else "Keff 10 % wrong")
        for axes in panels[1]:
            axes.set_xlabel("lag in samples")
    return figure


def _panel(axes: Axes, c: object, title: str) -> None:
    from livebode_control.validation.correlation import Correlation

    assert isinstance(c, Correlation)
    axes.fill_between(c.lags, -c.limit, c.limit, color=LIGHT.run, alpha=0.2, linewidth=0)
    for level, dashes in ((c.white_limit, (4, 2)), (OF_THE_PAPER, (1, 2))):
        for sign in (-1, 1):
            axes.axhline(sign * level, color=LIGHT.muted, linewidth=0.9, dashes=dashes)
    axes.vlines(c.lags, 0, c.value, color=np.where(c.judged, LIGHT.run, "#a9b4bf"), linewidth=1.8)
    reach = 1.15 * max(OF_THE_PAPER, float(np.max(np.abs(c.value))))
    axes.set_ylim(-reach, reach)
    axes.set_title(f"{title}: ε with {c.name}", loc="left", size=10)


STUDY = Study("fig14", "Fig. 14: validation", PAPER, measure, draw)
