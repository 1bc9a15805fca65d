"""`livebode orders`: torque that repeats with the angle of an axis's shafts."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from livebode.cli import From, Json, NextCommand, Rate, Time, To, console, results_directory
from livebode.core import OutputError, UsageError, counted, writing
from livebode.locations import location

if TYPE_CHECKING:
    from livebode.motion import Shaft
    from livebode_control.strokes.motion_samples import MotionSamples
    from livebode_control.strokes.order_changes import OrderChange
    from livebode_control.strokes.orders import OrderReport
    from livebode_control.strokes.shaft_orders import ShaftOrders

_POINTS = 512
_TABLE = "feedforward.csv"


def orders_command(
    target: Annotated[str, typer.Argument(metavar="RUN|LOG|AXIS.toml", help="A run, recording or configuration.")],
    input: Annotated[str | None, typer.Option(metavar="CHANNEL", help="Torque of the motor, or an expression.")] = None,
    position: Annotated[str | None, typer.Option(metavar="CHANNEL", help="Position of the motor.")] = None,
    velocity: Annotated[str | None, typer.Option(metavar="CHANNEL", help="Velocity of the motor.")] = None,
    angle: Annotated[
        str | None, typer.Option(metavar="CHANNEL", help="Angle of the motor, if the velocity is used.")
    ] = None,
    shaft: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=TURNS:ORDERS",
            help="A shaft, its turns in one turn of the motor, and its orders: gear=0.2:1,2,14; repeat for several.",
        ),
    ] = None,
    highest: Annotated[
        float | None, typer.Option(metavar="HZ", help="Highest frequency of an order; below the antiresonance.")
    ] = None,
    band: Annotated[
        float, typer.Option(metavar="HZ", help="Band in which friction and inertia are found; as in livebode friction.")
    ] = 5.0,
    time_lines: Annotated[
        str | None,
        typer.Option(metavar="HZ", help="Lines of an excitation or the mains, which are not orders: 20,40,50."),
    ] = None,
    baseline: Annotated[
        str | None,
        typer.Option(
            metavar="BEFORE", help="An earlier recording, configuration or run: report the orders that changed."
        ),
    ] = None,
    other_zero: Annotated[
        bool,
        typer.Option("--other-zero", help="The angle was homed again after BEFORE: compare the amplitudes only."),
    ] = False,
    from_: From = None,
    to: To = None,
    rate: Rate = None,
    time: Time = None,
    table: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write a feedforward table of the motor: .csv, .h (C) or .st (TwinCAT)."),
    ] = None,
    picture: Annotated[
        Path | None, typer.Option(metavar="SVG", help="Picture to write. \\[default: orders.svg in RUN]")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace an existing table or picture.")] = False,
    as_json: Json = False,
) -> NextCommand | None:
    """Find torque that repeats with the angle: cogging, eccentricity, gears; write a feedforward table.

    Shafts and channels default to those of the run or configuration, and the orders to 1 … 48 of the motor. Lines of
    the time are subtracted if the strokes separate them from the orders; else windows that meet them are left out:
    record strokes at several speeds. With --baseline, orders are compared with those of an earlier recording.
    """
    from livebode.configuration import OrdersSection
    from livebode.export import check_free
    from livebode.preparation import motion_part
    from livebode.records import to_json
    from livebode_control.strokes.motion_samples import read_strokes
    from livebode_control.strokes.orders import orders_of

    for path in filter(None, (table, picture)):
        check_free(path, force=force)
    motion = read_strokes(
        location(target), input=input, position=position, velocity=velocity, angle=angle, rate_hz=rate, time=time,
        part=motion_part(from_, to),
    )  # fmt: skip
    section = OrdersSection.model_validate(motion.settings.get("orders", {}))
    shafts = [_shaft(text) for text in shaft] if shaft else section.all_shafts()

    def found_in(samples: MotionSamples) -> OrderReport:
        return orders_of(
            samples,
            shafts,
            angle=samples.angle,
            turn=section.turn,
            lines_hz=_lines(time_lines, samples),
            highest_hz=highest if highest is not None else section.highest_hz or float("inf"),
            band_hz=band,
        )

    report = found_in(motion)
    changes: list[OrderChange] | None = None
    if baseline is not None:
        channels = {motion.kind: motion.output, "input": motion.input, "angle": motion.angle}
        before = found_in(read_strokes(location(baseline), rate_hz=rate, time=time, **channels))  # type: ignore[arg-type]
        changes = report.changes_from(before, phases=not other_zero)
    into = picture or (None if motion.run is None else results_directory(motion.run) / "orders.svg")
    if into is not None:
        from livebode_control.strokes.orders_picture import save_orders_picture

        with writing(into, OutputError):
            save_orders_picture(report, into, title=Path(target).name)
    if table is not None:
        _write_table(report, table, target)
    if as_json:
        more = {} if changes is None else {"changes": [change.plain() for change in changes]}
        print(to_json(report.plain() | more))
        return None
    show_orders(report)
    if changes is not None:
        show_changes(changes, report, Path(str(baseline)).name)
    if table is not None:
        print(f"feedforward of the motor, to be added to the torque: {table}")
    if into is not None:
        print(f"\n{into}")
    return _next(report, motion.run, written=table is not None or picture is not None)


def _next(report: OrderReport, run: Path | None, *, written: bool) -> NextCommand | None:
    """The same with a feedforward table, where one can be written; else the report of a run."""
    if not written and _motor(report) is not None and not Path(_TABLE).exists():
        return NextCommand.again(table=_TABLE)
    return None if run is None else NextCommand("report", run)


def _shaft(text: str) -> Shaft:
    from livebode.motion import Shaft

    name, _, description = text.partition("=")
    turns, _, orders = description.partition(":")
    try:
        numbers = float(turns), tuple(int(order) for order in orders.split(","))
    except ValueError:
        raise UsageError(
            "unreadable",
            f"the shaft {text!r} cannot be read",
            "write for example gear=0.2:1,2,14",
            argument="shaft",
            value=text,
        ) from None
    return Shaft(name.strip(), *numbers)


def _lines(text: str | None, motion: MotionSamples) -> Any:
    """Lines of the time: those that are given, else those of the configuration."""
    import numpy as np

    if text is None:
        return motion.lines_hz
    try:
        return np.array([float(number) for number in text.split(",")])
    except ValueError:
        raise UsageError(
            "unreadable",
            f"the lines {text!r} cannot be read",
            "write frequencies in Hz: 20,40,50",
            argument="time_lines",
            value=text,
        ) from None


def _motor(report: OrderReport) -> ShaftOrders | None:
    """The orders of the motor; None if none of them is seen."""
    return next((shaft for shaft in report.shafts if shaft.shaft.turns == 1 and shaft.seen.any()), None)


def _write_table(report: OrderReport, path: Path, target: str) -> None:
    import numpy as np

    from livebode_control.strokes.angle_table import write_angle_table

    motor = _motor(report)
    if motor is None:
        raise UsageError(
            "conflict",
            "no order of the motor is seen, so that there is nothing to feed forward",
            "name its orders, or record more strokes",
            argument="table",
        )
    angle = np.arange(_POINTS) * 2 * np.pi / _POINTS
    note = [f"livebode orders {Path(target).name}"] + [
        f"order {order}: {amplitude:.6g} +- {bound:.2g}, phase {phase:.4g} deg"
        for order, amplitude, bound, phase, seen in zip(
            motor.shaft.orders, motor.amplitude, motor.bound(), motor.phase_deg, motor.seen
        )
        if seen
    ]
    with writing(path, OutputError):
        write_angle_table(path, -motor.torque(angle), note, report.unit)


def show_orders(report: OrderReport) -> None:
    """Print the orders of each shaft that are seen, or that cannot be separated from a line."""
    import numpy as np

    screen = console(markup=False)
    low, high = report.speed_hz
    left_out = np.setdiff1d(report.lines_hz, report.subtracted_hz)
    lines = "".join(
        f"; lines of the time {words}: {', '.join(f'{f:g}' for f in each)} Hz"
        for words, each in (("subtracted", report.subtracted_hz), ("left out", left_out))
        if each.size
    )
    screen.print(f"{report.strokes} strokes at {low:.3g} … {high:.3g} turns/s of the motor{lines}", soft_wrap=True)
    for line in report.found_lines:
        size = f"{line.amplitude:.2g} {report.unit}".strip()
        screen.print(
            f"line of the time found at {line.frequency_hz:.4g} Hz, amplitude {size}: not an order, left out",
            soft_wrap=True,
        )
    for shaft in report.shafts:
        _show_shaft(shaft, report.unit)
    for errors in report.errors:
        bound = errors.bound()
        for i in np.flatnonzero(errors.seen):
            screen.print(
                f"order {errors.shaft.orders[i]} of the {errors.shaft.name} grows with the square of the speed, as an "
                f"error of the measured angle of {abs(errors.value[i]):.3g} ± {bound[i]:.2g} rad of the motor",
                soft_wrap=True,
            )
    if not all(shaft.by_strokes for shaft in report.shafts):
        screen.print(
            "fewer than four strokes: a line of the time at constant speed is not told from an order", soft_wrap=True
        )


def show_changes(changes: list[OrderChange], report: OrderReport, baseline: str) -> None:
    """Print the orders that changed since the baseline."""
    from livebode_control.strokes.order_changes import FALSE_ALARM

    screen = console(markup=False)
    changed = [change for change in changes if change.changed]
    for change in changed:
        screen.print(change.sentence(report.unit), soft_wrap=True)
    words = f"{counted(len(changed), 'order') if changed else 'no order'} changed"
    screen.print(
        f"compared with {baseline}: {words} of {len(changes)}; probability of a false alarm {100 * FALSE_ALARM:g} %",
        soft_wrap=True,
    )


def _show_shaft(orders: ShaftOrders, unit: str) -> None:
    from rich.table import Table

    screen = console(markup=False)
    turns = "" if orders.shaft.turns == 1 else f", {orders.shaft.turns:.4g} turns in one of the motor"
    screen.print(f"{orders.shaft.name}{turns}:", soft_wrap=True)
    table = Table(box=None, header_style="bold")
    for heading in ("order", f"amplitude {unit}".strip(), "± 95 %", "± per ms of delay", "phase deg", "strokes", ""):
        table.add_column(heading, justify="left" if not heading else "right")
    bound = orders.bound()
    for i, order in enumerate(orders.shaft.orders):
        if orders.meets_hz[i] == orders.meets_hz[i]:
            table.add_row(str(order), "", "", "", "", "", f"meets the line at {orders.meets_hz[i]:g} Hz at every speed")
        elif orders.seen[i]:
            numbers = (orders.amplitude[i], bound[i], orders.per_delay_s[i] / 1000, orders.phase_deg[i])
            table.add_row(str(order), *(f"{value:.3g}" for value in numbers), str(orders.strokes[i]), "")
    if table.row_count:
        screen.print(table)
    known = [
        i for i in range(len(orders.shaft.orders)) if not orders.seen[i] and orders.strokes[i] and bound[i] == bound[i]
    ]
    if known:
        most = max(float(bound[i]) for i in known)
        screen.print(f"  not seen: {len(known)} orders, each known to ± {most:.2g} {unit}".rstrip(), soft_wrap=True)
    lost = sum(1 for i in range(len(bound)) if bound[i] != bound[i] and orders.meets_hz[i] != orders.meets_hz[i])
    if lost:
        screen.print(f"  not known: {lost} orders, too fast or in too few strokes", soft_wrap=True)
