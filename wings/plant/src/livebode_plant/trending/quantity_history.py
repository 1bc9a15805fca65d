"""History: a quantity of many machines over all of their runs, read from a lake."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from datetime import datetime

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import LEVELS, ArchiveError, Level, nearest_name
from livebode.dataclass import dataclass
from livebode_plant.lake import Lake
from livebode_plant.trending.trend import NotAssessed, Trend, trend_of

UNNAMED = "unnamed"
"""The machine of runs whose configuration names none."""
_KEY = ["content", "recipe"]
_NAMES = ["model", "name", "unit"]
_COLUMNS = [*_KEY, *LEVELS, "recorded_from", *_NAMES, "value", "bound_95", "covariates"]


@dataclass(frozen=True, eq=False)
class MachineHistory:
    """A quantity of one machine, or of all axes of a level, in the order of time.

    Attributes
    ----------
    axes
        Paths of the axes.
    member
        Number of the axis of each run, (runs,).
    time_s
        Begin of each recording, s since 1970, (runs,).
    value, bound_95
        The quantity, and its 95 % bound, (runs,).
    covariates
        Mean of each covariate during each run, NaN where it was not recorded, (runs,).
    """

    axes: tuple[str, ...]
    member: NDArray[np.intp]
    time_s: Floats
    value: Floats
    bound_95: Floats
    covariates: Mapping[str, Floats]

    def trend(self) -> Trend | NotAssessed:
        """The trend; of several axes in percent of the median of each.

        Several axes are taken to change alike. Where they do not, the result is between their trends, and jumps of one
        axis may be outliers of all.
        """
        if len(self.axes) == 1:
            return trend_of(self.time_s, self.value, self.bound_95, self.covariates)
        share = np.ones(len(self.value))
        for axis in range(len(self.axes)):
            here = self.member == axis
            middle = abs(float(np.median(self.value[here])))
            share[here] = 100 / middle if middle > 0 else np.nan
        return trend_of(self.time_s, self.value * share, self.bound_95 * share, self.covariates, self.member)


@dataclass(frozen=True, eq=False)
class History:
    """A quantity of all machines.

    Attributes
    ----------
    model, name, unit
        Of the quantity.
    machines
        By path, in the order of the names.
    undated
        Number of runs that have no date.
    recipe
        The settings with which most recordings were tracked.
    other_recipes
        Number of runs of an axis with other settings than most of its runs, which are left out: values of different
        settings are no trend.
    """

    model: str
    name: str
    unit: str
    machines: Mapping[str, MachineHistory]
    undated: int
    recipe: str
    other_recipes: int

    @property
    def runs(self) -> int:
        """Number of runs with a date."""
        return sum(len(machine.time_s) for machine in self.machines.values())

    def unit_of(self, machine: str) -> str:
        """The unit of the trend: percent if the axes of the level have different levels."""
        return self.unit if len(self.machines[machine].axes) == 1 else "%"


@dataclass(frozen=True)
class Selection:
    """Which runs of a lake.

    Parameters
    ----------
    by
        Machines with the same names up to this level are one row.
    below
        Begin of the paths of the machines; all if empty.
    since, until
        Of the date of the recording, with a zone; the end is not included.
    covariates
        Names; None: all that the runs have.
    recipe
        Begin of the id of the settings. None: for each axis those of its most runs.
    excluded
        Contents of recordings that are left out.
    """

    by: Level = "machine"
    below: str = ""
    since: datetime | None = None
    until: datetime | None = None
    covariates: Sequence[str] | None = None
    recipe: str | None = None
    excluded: Sequence[str] = ()

    def includes(self, axis: str) -> bool:
        """Whether this axis is below the selected machine."""
        return not self.below or axis == self.below or axis.startswith(self.below + "/")

    def without(self, contents: Sequence[str]) -> Selection:
        """This selection without these recordings."""
        return replace(self, excluded=(*self.excluded, *contents))


def history(lake: Lake, quantity: str, of: Selection) -> History:
    """A quantity of the runs that count, read with as few rows and columns as possible.

    Parameters
    ----------
    lake
        The lake.
    quantity
        Name, or model:name where several models have it; upper and lower case are the same where that is unambiguous.
    of
        Which runs.

    Raises
    ------
    ArchiveError
        If there is no such quantity, several have the name, no run has the recipe or a covariate, or the lake cannot
        be read.
    """
    rows = lake.counted("quantities", _COLUMNS, where_of(of) & (pc.field("name") == quantity))
    models = pc.unique(rows["model"]).to_pylist()
    model, name = (models[0], quantity) if len(models) == 1 else _resolved(lake, quantity)
    if name != quantity or not models:
        of_it = (pc.field("name") == name) & (pc.field("model") == model)
        rows = lake.counted("quantities", _COLUMNS, where_of(of) & of_it)
    return _history(rows, of, model, name)


def histories(lake: Lake, of: Selection) -> list[History]:
    """All quantities of the runs that count, in the order of models and names."""
    rows = lake.counted("quantities", _COLUMNS, where_of(of))
    own = rows if of.recipe is None else recipe_of_each(rows, of.recipe)[0]
    return [
        _history(rows.filter((pc.field("model") == model) & (pc.field("name") == name)), of, model, name)
        for model, name in _quantities(own)
    ]


def _history(rows: pa.Table, of: Selection, model: str, name: str) -> History:
    rows, recipe, others = recipe_of_each(rows, of.recipe)
    path = rows["axis path"]
    if of.below:
        rows = rows.filter(pc.or_(pc.equal(path, of.below), pc.starts_with(path, of.below + "/")))
    dated = rows.filter(pc.field("recorded_from").is_valid()).sort_by([("recorded_from", "ascending"), *_ascending()])
    units = pc.unique(rows["unit"]).to_pylist()
    return History(
        model, name, units[0] if units else "", dict(_machines(dated, of)), rows.num_rows - dated.num_rows, recipe,
        others,
    )  # fmt: skip


def _ascending() -> list[tuple[str, str]]:
    """So that runs of the same moment have the same order each time."""
    return [(name, "ascending") for name in _KEY]


def _machines(rows: pa.Table, of: Selection) -> Iterator[tuple[str, MachineHistory]]:
    paths = _path(rows, LEVELS[: LEVELS.index(of.by) + 1]).dictionary_encode()
    codes, names = paths.indices.to_numpy(), paths.dictionary.to_pylist()
    time_s = rows["recorded_from"].cast(pa.int64()).to_numpy() / 1e6
    value, bound = (_numbers(rows[name]) for name in ("value", "bound_95"))
    covariates = _covariates(rows["covariates"], of.covariates)
    axes, axis_codes = np.unique(rows["axis path"].to_numpy(zero_copy_only=False).astype(str), return_inverse=True)
    for name, code in sorted(zip(names, range(len(names)))):
        here = np.flatnonzero(codes == code)
        own, member = np.unique(axis_codes[here], return_inverse=True)
        yield name, MachineHistory(
            tuple(axes[own].tolist()), member, time_s[here], value[here], bound[here],
            {key: x[here] for key, x in covariates.items() if np.isfinite(x[here]).any()},
        )  # fmt: skip


def _covariates(column: pa.ChunkedArray, names: Sequence[str] | None) -> dict[str, Floats]:
    maps = column.combine_chunks()
    known = sorted(set(pc.unique(maps.keys).to_pylist())) if len(maps) else []
    for name in names or ():
        if known and name not in known:
            raise ArchiveError(
                "covariate-unknown",
                f"no run has the covariate {name!r}",
                nearest_name(name, known, "Covariates"),
                covariate=name,
            )
    return {
        name: _numbers(pc.map_lookup(maps, pa.scalar(name), "first"))
        for name in (known if names is None else names)
        if name in known
    }


def _numbers(column: pa.ChunkedArray | pa.Array) -> Floats:
    return np.asarray(pc.fill_null(column, np.nan).to_numpy(zero_copy_only=False), dtype=np.float64)


def _path(rows: pa.Table, levels: Sequence[str]) -> pa.Array:
    """site/line/machine/axis without the levels that are not known."""
    path = pa.repeat("", rows.num_rows)
    for level in levels:
        own = pc.fill_null(rows[level].combine_chunks(), "")
        between = pc.if_else(pc.or_(pc.equal(path, ""), pc.equal(own, "")), "", "/")
        path = pc.binary_join_element_wise(path, between, own, "")
    return pc.if_else(pc.equal(path, ""), UNNAMED, path)


def recipe_of_each(rows: pa.Table, recipe: str | None) -> tuple[pa.Table, str, int]:
    """For each axis the rows with this recipe, or with that of its most rows; the most frequent id, and the number of
    other rows. The rows have a column "axis path" then."""
    rows = rows.append_column("axis path", _path(rows, LEVELS))
    named = rows
    if recipe is not None:
        named = rows.filter(pc.starts_with(rows["recipe"], recipe))
        if not named.num_rows:
            raise ArchiveError(
                "recipe-unknown",
                f"no run was tracked with the recipe {recipe!r}",
                nearest_name(recipe, pc.unique(rows["recipe"]).to_pylist(), "Recipes"),
                recipe=recipe,
            )
    counts = named.group_by(["axis path", "recipe"]).aggregate([([], "count_all")]).to_pylist()
    counts.sort(key=lambda count: (-count["count_all"], count["recipe"]))
    of_axis: dict[str, str] = {}
    for count in counts:
        of_axis.setdefault(count["axis path"], count["recipe"])
    chosen = pa.array([f"{path}/{own}" for path, own in of_axis.items()], pa.string())
    own = pc.binary_join_element_wise(named["axis path"], named["recipe"], "/")
    kept = named.filter(pc.is_in(own, value_set=chosen))
    return kept, counts[0]["recipe"] if counts else "", rows.num_rows - kept.num_rows


def where_of(of: Selection) -> pc.Expression:
    """Runs of the span; those without a date count, so that their number is known."""
    at, where = pc.field("recorded_from"), pc.scalar(True)
    if of.since is not None:
        where &= at.is_null() | (at >= pa.scalar(of.since, pa.timestamp("us", tz="UTC")))
    if of.excluded:
        where &= ~pc.field("content").isin(list(of.excluded))
    if of.until is not None:
        where &= at.is_null() | (at < pa.scalar(of.until, pa.timestamp("us", tz="UTC")))
    return where


def _quantities(rows: pa.Table) -> list[tuple[str, str]]:
    groups = rows.select(["model", "name"]).group_by(["model", "name"]).aggregate([])
    return sorted(zip(groups["model"].to_pylist(), groups["name"].to_pylist()))


def _resolved(lake: Lake, quantity: str) -> tuple[str, str]:
    """Model and name of a quantity."""
    known = _quantities(lake.read("quantities", ["model", "name"]))
    for same in (str, str.casefold):
        wanted = same(quantity)
        matches = [(m, n) for m, n in known if wanted in (same(n), same(f"{m}:{n}"))]
        if len(matches) == 1:
            return matches[0]
        if matches:
            raise ArchiveError(
                "quantity-ambiguous",
                f"{len(matches)} quantities have the name {quantity!r}",
                f"choose one: {', '.join(f'{m}:{n}' for m, n in matches)}",
                quantity=quantity,
            )
    raise ArchiveError(
        "quantity-unknown",
        f"the lake {lake.url!r} has no quantity {quantity!r}",
        nearest_name(quantity, sorted({n for _, n in known}), "Quantities"),
        quantity=quantity,
        lake=lake.url,
    )
