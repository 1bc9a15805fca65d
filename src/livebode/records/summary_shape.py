"""Names and types in run.json: an untrusted file is checked before it is used."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from livebode.core import ClockKind, Field, QuantityKind, TypedTable, errors_of
from livebode.estimates import RESPONSE, kind_of

Text = Annotated[str, Field(max_length=100_000)]
Digest = Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
Count = Annotated[int, Field(ge=0, lt=1 << 62)]
Positive = Annotated[int, Field(gt=0, lt=1 << 62)]
Epoch = Annotated[int, Field(ge=0, lt=1 << 64)]  # the frames have 64 bits for it
Section = dict[str, Any]


class _Part(TypedTable, extra="allow", strict=True, allow_inf_nan=False):
    """A table whose further keys are not checked."""


class _Kinds(TypedTable, extra="forbid", strict=True, allow_inf_nan=False):
    output: QuantityKind | None
    input: QuantityKind | None
    output_unit: Text = ""
    input_unit: Text = ""
    output_name: Text = ""
    input_name: Text = ""


class _Samples(_Part):
    first: Count
    stop: Count | None


class _Recording(_Part):
    file: Text
    first: Count
    stop: Count


class _SourceUnit(_Part):
    unit: Text
    factor: Annotated[float, Field(gt=0)]


class _Found(_Part):
    rate_hz: Annotated[float, Field(gt=0)]
    window: Positive
    bins: list[Positive]
    quiet_bins: list[Positive]
    quantity: Text
    unit: Text
    source_unit: _SourceUnit | None = None
    clock: ClockKind | None = None
    kinds: _Kinds = _Kinds(output=None, input=None)
    hop: Positive = 1
    frequency_hz: list[float] = []
    schedule: Text | None = None
    format: Text | None = None
    rate_from: Text | None = None
    part: _Samples | None = None
    recordings: list[_Recording] = []
    realisations: bool = False


Names = Annotated[list[Text], Field(min_length=1, max_length=8)]


class _MatrixFound(_Found):
    outputs: Names
    inputs: Names
    units: list[list[Text]]
    kinds_of_entries: list[list[_Kinds]]

    def check(self) -> None:
        """ValueError if the lists are not those of one matrix."""
        for name, rows in (("units", self.units), ("kinds_of_entries", self.kinds_of_entries)):
            if [len(row) for row in rows] != [len(self.inputs)] * len(self.outputs):
                raise ValueError(f"{name} has not one element for each entry")
        if len({*self.outputs}) != len(self.outputs) or len({*self.inputs}) != len(self.inputs):
            raise ValueError("a signal is duplicated")


class _OutputOnlyFound(_Part):
    rate_hz: Annotated[float, Field(gt=0)]
    window: Positive
    hop: Positive
    outputs: list[Text]
    band_hz: Annotated[list[float], Field(min_length=2, max_length=2)]
    clock: ClockKind | None = None
    part: _Samples | None = None


class _Track(_Part):
    name: Text
    rows: Count
    frequency_hz: Annotated[list[float], Field(min_length=2, max_length=2)]


class _Speed(_Part):
    recorded_s: float
    run_s: float
    times_real_time: float


class _Record(_Part):
    finished: bool
    tables: list[Text] = []


class _Recorded(_Part):
    from_: Text | None = Field(alias="from")
    to: Text | None
    clock: Literal["time of day", "file", "unknown"]


class _ContentFile(_Part):
    file: Text
    sha256: Digest


class _Content(_Part):
    sha256: Digest
    files: list[_ContentFile]


class _Configuration(_Part):
    signals: dict[str, Any] = {}
    source: Section = {}
    tracking: Section | None = None
    lines: Section | None = None
    monitoring: Section | None = None
    record: Section | None = None
    fit: Section | None = None
    loop: Section | None = None


class _AnySummary(_Part):
    configuration: _Configuration = _Configuration()
    counts: dict[str, Count | None] = {}
    size_bytes: dict[str, Count] = {}
    speed: _Speed | None = None
    versions: Section = {}
    machine: dict[Text, Text] = {}
    recorded: _Recorded | None = None
    content: _Content | None = None
    recipe: Text | None = None
    source: Section | None = None
    fit: Section | None = None
    loop: Section | None = None
    monitoring: Section | None = None
    drift: Section | None = None
    between: Section | None = None
    record: _Record | None = None
    left_out_samples: Count | None = None
    clock: list[Annotated[list[float], Field(min_length=2, max_length=2)]] | None = None
    numbering: list[Annotated[tuple[Count, Epoch, Count], Field(strict=False)]] = []  # JSON has lists
    files: dict[str, list[Section]] = {}


class _Summary(_AnySummary):
    found: _Found
    output_only: Literal[False] = False
    matrix: Literal[False] = False


class _MatrixColumn(_Part):
    input: Text
    valid: Count
    reasons: dict[Text, Count] = {}


class _MatrixSummary(_AnySummary):
    found: _MatrixFound
    output_only: Literal[False] = False
    matrix: Literal[True]
    columns: list[_MatrixColumn] = []


class _OutputOnlySummary(_AnySummary):
    found: _OutputOnlyFound
    output_only: Literal[True]
    modes: list[_Track] = []
    harmonics: list[_Track] = []


def what_is_wrong(summary: dict[str, Any]) -> str:
    """Description of the first invalid value; empty if there is none.

    >>> what_is_wrong({"found": {"rate_hz": "fast", "window": 10, "bins": [1], "quiet_bins": []}})
    'found.rate_hz: Input should be a valid number'
    """
    try:
        _SHAPES.get(kind_of(summary), _AnySummary).model_validate(summary)
    except ValueError as error:
        first = errors_of(error)[0]
        return f"{'.'.join(map(str, first['loc']))}: {first['msg']}"
    return ""


_SHAPES: dict[str, type[_AnySummary]] = {
    RESPONSE: _Summary,
    "matrix": _MatrixSummary,
    "output_only": _OutputOnlySummary,
}
