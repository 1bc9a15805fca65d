"""The analyses of a run in Python: `livebode.Run(path).analysis("friction")()`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from livebode.configuration import OrdersSection
from livebode_control.loop_check.loop_check import LoopCheck
from livebode_control.loop_check.run_loop_check import check_loop_of_run
from livebode_control.margins.loop_margins import LoopMargins, margins_of_run
from livebode_control.proposal.tune_report import tune_run
from livebode_control.strokes.friction import FrictionReport, friction_of
from livebode_control.strokes.motion_samples import read_strokes
from livebode_control.strokes.orders import OrderReport, orders_of
from livebode_control.tuning import ControllerProposal, LoopSpecification
from livebode_control.validation.section import ValidationReport, validation_report

if TYPE_CHECKING:
    from livebode import Run


def loop_margins(run: Run, **options: Any) -> LoopMargins:
    """Margins of the run's loop with the filter that increases them; `options` are those of `margins_of_run`."""
    return margins_of_run(Path(run.path), **options)


def loop_check(run: Run, **channels: str) -> LoopCheck:
    """The described controllers compared with the signals; `channels` replace those of the run by role."""
    return check_loop_of_run(run.path, channels=dict(channels))[0]


def proposal(
    run: Run, specification: LoopSpecification | None = None, *, loop_checked: bool = False, entry: str | None = None
) -> ControllerProposal:
    """Controller and filters for the described loop; see `tune_run`."""
    return tune_run(run.path, specification or LoopSpecification(), loop_checked=loop_checked, entry=entry)


def validation(run: Run, on: str | Path) -> ValidationReport:
    """The model of the run's [fit] tested on another recording, which the run does not contain."""
    return validation_report(Path(run.path), Path(on))


def friction(run: Run, **options: Any) -> FrictionReport:
    """Friction in the recording of the run; `options` are those of `friction_of`."""
    return friction_of(read_strokes(run.path), **options)


def orders(run: Run, **options: Any) -> OrderReport:
    """Orders of the shafts under [orders] in the recording of the run; `options` are those of `orders_of`."""
    motion = read_strokes(run.path)
    section = OrdersSection.model_validate(motion.settings.get("orders", {}))
    given = {
        "angle": motion.angle,
        "turn": section.turn,
        "lines_hz": motion.lines_hz,
        "highest_hz": section.highest_hz or float("inf"),
    }
    return orders_of(motion, section.all_shafts(), **(given | options))
