"""Validation of a run's model in its report: the findings of the first page, and a section (`livebode report --on`)."""

from __future__ import annotations

from pathlib import Path

from livebode.configuration import FitSection, recorded_configuration
from livebode.core import Finding, Paragraph, Part, Picture, PrintedTable, Section, Tone
from livebode.dataclass import dataclass
from livebode.language import number, tr, worded
from livebode.records import RunRecord
from livebode_control.validation.run_validation import validate_run
from livebode_control.validation.validation import Validation

_TONES: dict[str, Tone] = {"passes": "ok", "small error": "ok", "fails": "check", "cannot be judged": "open"}
_FIGURE = "livebode_control.validation.validation_picture:validation_figure"


@dataclass(frozen=True, eq=False)
class ValidationReport:
    """Verdicts and remarks of a validation on the recording of this name."""

    on: str
    validations: tuple[Validation, ...]
    notes: tuple[str, ...]

    def findings(self) -> list[Finding]:
        """A verdict for each model."""
        return [
            Finding(
                _TONES[v.verdict], tr("On {recording}: {sentence}.", recording=self.on, sentence=worded(v.sentence))
            )
            for v in self.validations
        ]

    def section(self) -> Section:
        """Verdicts, correlations and their picture."""
        parts: list[Part] = [Paragraph(f"{worded(v.sentence)}.") for v in self.validations]
        rows = tuple(
            (
                worded(v.model), c.name, f"{number(100 * c.share, '.0f')} %", number(c.largest, ".3g"),
                number(c.p, ".2g"), tr("yes") if c.name in v.judged_by else tr("no"),
            )
            for v in self.validations
            for c in v.correlations
        )  # fmt: skip
        headings = (tr("model"), tr("ε with"), tr("lags inside"), tr("largest"), tr("joint p"), tr("counts"))
        parts.append(PrintedTable(headings, rows, (2, 3, 4), " ".join(f"{worded(n)}." for n in self.notes)))
        caption = tr(
            "On {recording}: measured and simulated output, and the residual's correlations with their limits.",
            recording=self.on,
        )
        drawn = {"validations": self.validations, "title": tr("Measured and simulated")}
        parts.append(Picture(_FIGURE, drawn, caption))
        return Section(tr("Validation"), tuple(parts))


def validation_report(directory: Path, on: Path) -> ValidationReport:
    """The model of a run's [fit], simulated with another recording; see `validate_run`."""
    section = FitSection.model_validate(recorded_configuration(RunRecord.open(directory).summary).get("fit", {}))
    results, notes = validate_run(directory, on, [section])
    return ValidationReport(on.name, tuple(results), tuple(notes))
