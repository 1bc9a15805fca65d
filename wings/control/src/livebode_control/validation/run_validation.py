"""A run's fitted model judged on another recording."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from livebode.analysis import fit_run
from livebode.configuration import Axis, FitSection, recorded_configuration
from livebode.core import FitError, RecordError, UsageError
from livebode.language import Message
from livebode.locations import Location, resolved
from livebode.records import RunRecord
from livebode.sources import open_log
from livebode_control.clean_stretch import clean_stretch
from livebode_control.validation.validation import Validation, validate


def validate_run(
    directory: Path,
    log: Path,
    sections: list[FitSection],
    *,
    samples: int | None = None,
    channels: dict[str, str | None] | None = None,
) -> tuple[list[Validation], list[str]]:
    """One verdict for each section's model, all on the same samples of `log`; and a list of remarks.

    Rate, loop and channels are those of the run's configuration; `channels` can replace output, input or excitation.
    The excitation may be missing in `log`. Of a recording with gaps or samples that are not finite, the longest clean
    stretch in which the machine is ready is used; of that the last `samples`, where the transient has decayed. The
    remarks report this, models that were not fitted, and whether the recording is that of the run.

    Raises
    ------
    RecordError
        If the run does not name the channels that are needed.
    RecordingError, SignalError, UsageError
        If the recording lacks a channel or has no stretch that is long enough.
    FitError
        If no model could be fitted.
    """
    own_words = recorded_configuration(RunRecord.open(directory).summary)
    if "signals" not in own_words:
        raise RecordError(
            "not-tracked",
            f"{str(directory)!r} does not name the channels that it was computed from",
            "create it with `livebode run`",
            path=str(directory),
        )
    axis = Axis.of(
        {key: own_words[key] for key in ("source", "signals", "loop", "monitoring") if key in own_words}, str(directory)
    )
    named = {role: name for role, name in (channels or {}).items() if name}
    signals = axis.signals.over(named)
    if signals.input is None:
        raise RecordError(
            "not-tracked",
            "the run has no plant input u, which a simulation of the model needs",
            "run again with signals.input",
            path=str(directory),
            role="input",
        )
    notes = _freshness(axis.source.logs, log)
    given = axis.source
    opened = open_log(
        log, rate_hz=given.rate_hz, time=given.time, dbc=given.dbc, channels=[signals.output], units=given.units
    )
    if signals.excitation and "excitation" not in named and not opened.has(signals.excitation):
        notes.append(
            Message(
                "{recording} has no channel {channel}: judged without the excitation w",
                recording=log.name,
                channel=repr(signals.excitation),
            )
        )
        signals = signals.over({"excitation": None})
    names = [name for name in (signals.input, signals.output, signals.excitation) if name]
    ready = axis.ready
    if ready is not None and not opened.has(ready.channel):
        notes.append(f"{log.name} has no channel {ready.channel!r}: judged as if the machine was always ready")
        ready = None
    block, recorded = clean_stretch(opened, names, ready)
    if len(block) < recorded:
        also = "" if ready is None else ", or samples at which the machine is not ready"
        notes.append(
            f"gaps or samples that are not finite{also}: the longest clean stretch, {len(block)} of {recorded}"
        )
    if samples is not None:
        if samples > len(block):
            raise UsageError(
                "out-of-range",
                f"{samples=} is more than the {len(block)} clean ones in a row",
                "choose fewer",
                argument="samples",
                value=samples,
                limit=len(block),
            )
        block = block.cut(len(block) - samples, len(block))
    loop = axis.loop.build(block.rate_hz)
    roles = {"input": signals.input, "output": signals.output, "excitation": signals.excitation}
    fits = [fit_run(directory, section)[0] for section in sections]
    judged = [validate(fit, block, loop=loop, **roles) for fit in fits if fit.status == "ok"]  # type: ignore[arg-type]
    refused = [
        Message("{model} was not fitted: {why}", model=fit.model.name, why=fit.sentence)
        for fit in fits
        if fit.status != "ok"
    ]
    if not judged:
        raise FitError(
            "not-fitted",
            "; ".join(refused),
            "set fit.output, or fit another model",
            models=[fit.model.name for fit in fits],
        )
    return judged, notes + refused


def _freshness(own: Sequence[Location], log: Location) -> list[str]:
    if resolved(log) not in map(resolved, own):
        return []
    return [
        Message(
            "{recording} is the recording of the run: this is not independent data, because the model was fitted to it",
            recording=log.name,
        )
    ]
