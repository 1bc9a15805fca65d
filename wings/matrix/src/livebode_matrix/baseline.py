"""MatrixBaseline: the matrices of a healthy machine, from its run."""

from __future__ import annotations

from pathlib import Path

from livebode.configuration import recorded_configuration
from livebode.core import BaselineError, Lines, LivebodeError, MatrixResponses, counted
from livebode.dataclass import dataclass
from livebode.fitting import mean_matrix
from livebode.records import RunRecord
from livebode_matrix.settings import MatrixSettings

_NAME_A_RUN = "specify the directory of a matrix run of the healthy machine"


@dataclass(frozen=True, eq=False)
class MatrixBaseline:
    """The matrices of a run.

    Attributes
    ----------
    path
        Directory of the run.
    matrices
        All of them: their differences show how far the errors of the lines are alike.
    mean
        One row.
    estimator
        Of the run.
    """

    path: Path
    matrices: MatrixResponses
    mean: MatrixResponses
    estimator: str

    @classmethod
    def load(cls, path: Path) -> MatrixBaseline:
        """The run in this directory as a baseline; BaselineError if there is none, or it has no valid matrices."""
        if not path.exists():
            raise BaselineError("absent", f"there is no baseline {str(path)!r}", _NAME_A_RUN, path=str(path))
        try:
            run = RunRecord.open(path, matrix=True)
            matrices = run.matrix()
            mean = mean_matrix(matrices)
        except LivebodeError as error:
            raise BaselineError(
                "not-a-baseline",
                f"{str(path)!r} is not a baseline of a matrix: {error}",
                _NAME_A_RUN,
                path=str(path),
                reason=str(error),
            ) from None
        tracking = recorded_configuration(run.summary).get("tracking", {})
        return cls(path, matrices, mean, str(tracking.get("estimator", "joint")))

    def check(self, settings: MatrixSettings) -> None:
        """BaselineError where a run with these settings cannot be compared with it."""
        mine, lines = self.mean.lines, settings.lines
        for name, healthy, here in (
            ("rate", f"{mine.rate_hz:g} Hz", f"{lines.rate_hz:g} Hz"),
            ("window", counted(mine.window, "sample"), counted(lines.window, "sample")),
            ("lines", _listed(mine), _listed(lines)),
            ("outputs", ", ".join(self.mean.outputs), ", ".join(settings.output)),
            ("inputs", ", ".join(self.mean.inputs), ", ".join(settings.columns)),
            ("estimator", self.estimator, settings.estimator),
        ):
            if healthy != here:
                raise BaselineError(
                    "settings-differ",
                    f"the baseline {str(self.path)!r} has the {name} {healthy}, and this run has {here}",
                    f"take the same {name}, or a baseline from such a run",
                    setting=name,
                    learned=healthy,
                    value=here,
                )


def _listed(lines: Lines) -> str:
    return ", ".join(f"{f:g}" for f in lines.frequency_hz) + " Hz"
