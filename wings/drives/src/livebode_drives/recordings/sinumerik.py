"""Sinumerik 840D: the XML in which the control stores a measured frequency response, its arrays as text of base 85."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from os import PathLike
from pathlib import Path
from typing import ClassVar
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from livebode.core import RecordingError
from livebode.dataclass import dataclass
from livebode.sources import Chunk, Column, Recording, contained, damaged, exact_rate_hz, truncated
from livebode_drives.recordings.safexml import parse

ALPHABET = b"0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ!#$`()*+-/:;=?@[]^_{|}~"
ZEROS = b"."
"""Code for four zero bytes."""
VALUES = np.full(256, 255, np.uint8)
VALUES[np.frombuffer(ALPHABET, np.uint8)] = np.arange(85)
WEIGHTS = 85 ** np.arange(4, -1, -1, dtype=np.int64)


def decode(text: str) -> NDArray[np.float64]:
    """Big-endian doubles from text, five characters for four bytes; white space is ignored.

    >>> decode(" ........ ")
    array([0., 0., 0., 0.])

    Raises
    ------
    RecordingError
        For a character outside the alphabet, a group above 2³²−1, or a length that is not a whole number of doubles.
    """
    raw = "".join(text.split()).encode("ascii", "replace").replace(ZEROS, b"00000")
    values = VALUES[np.frombuffer(raw, np.uint8)]
    if (bad := np.flatnonzero(values == 255)).size:
        character = chr(raw[int(bad[0])])
        raise damaged(f"character {character!r} is not base-85 text", character=character)
    if len(values) % 10:
        raise truncated(
            f"{len(values)} characters of base-85 text are not a whole number of values", length=len(values)
        )
    words = values.reshape(-1, 5).astype(np.int64) @ WEIGHTS
    if words.size and int(words.max()) > 0xFFFFFFFF:
        raise damaged("a group of base-85 text is above 4294967295")
    return words.astype(">u4").view(">f8").astype(np.float64)


@dataclass(frozen=True)
class SinumerikSpectra:
    """Spectra that the control averaged over the records, at bins 0, 1, … of a record.

    Parameters
    ----------
    frequency_hz
        The control's own axis, shape (bins,); it is wrong by the control's assumption on the bins of a record.
    input_auto, output_auto
        Shape (bins,), real in content.
    cross
        Between output and input, shape (bins,); output over input is conj(cross) / input_auto.
    """

    frequency_hz: NDArray[np.float64]
    input_auto: NDArray[np.complex128]
    output_auto: NDArray[np.complex128]
    cross: NDArray[np.complex128]


class SinumerikRecording(Recording):
    """The time records of a measurement, one after the other: channels "input" and "output", a break before each.

    A record is taken in one direction of motion; the pause between two records is not stored.
    """

    format: ClassVar[str] = "sinumerik"

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        root = parse(path)
        nodes = measured_nodes(root)
        lengths = {tuple(len(record) for record in records(node)) for node in nodes.values()}
        if len(lengths) != 1:
            raise RecordingError(
                "lengths-differ",
                f"the signals in {path} have records of different lengths {sorted(lengths)}",
                "check that the file is complete",
                path=str(path),
                samples=sorted(lengths),
            )
        self._values = {name: np.concatenate(list(records(node))) for name, node in nodes.items()}
        starts = np.cumsum(lengths.pop())
        self.breaks = tuple(int(start) for start in starts[:-1])
        self.rate_hz = exact_rate_hz(update_time_s(root), 0.0)
        self.columns = tuple(
            Column(name, samples=int(starts[-1]), aliases=(f"node_{number(node, 'm_uNodeId'):.0f}",), key=name)
            for name, node in nodes.items()
        )

    def chunks(self, columns: Sequence[Column], rows: int) -> Iterator[Chunk]:
        for first in range(0, columns[0].samples or 0, rows):
            yield [self._values[column.key][first : first + rows] for column in columns]


def sinumerik_spectra(path: str | PathLike[str]) -> SinumerikSpectra:
    """The auto- and cross-spectra that the control computed and stored with the time records.

    Raises
    ------
    RecordingError
        Where the file is not a Sinumerik measurement or was stored without spectra.
    """
    path = Path(path)
    with contained(path, "Sinumerik XML"):
        nodes = measured_nodes(parse(path))
        input_id = number(nodes["input"], "m_uNodeId")
        cross = [
            info
            for info in nodes["output"].iter("SigNodeCrossSpectrumInfo")
            if info.get("name") == "m_crossSpecInfoList_el" and number(info, "m_uSignodeId") == input_id
        ]
        if not cross:
            raise RecordingError(
                "incomplete",
                f"{path} has no cross-spectrum of output and input",
                "configure the control to store spectra",
                path=str(path),
                part="SigNodeCrossSpectrumInfo",
            )
        return SinumerikSpectra(
            numeric_array(child(cross[0], "m_FrequencyVector", deep=True), 1),
            spectrum(child(nodes["input"], "m_autospectrumInfo")),
            spectrum(child(nodes["output"], "m_autospectrumInfo")),
            spectrum(cross[0]),
        )


def measured_nodes(root: Element) -> dict[str, Element]:
    """The signals "input" and "output" of the measurement, then any other as node_<number>."""
    nodes = [node for node in root.iter("PlatformSignalNode") if next(node.iter("TimeSeries"), None) is not None]
    if len(nodes) < 2:
        raise RecordingError(
            "incomplete",
            f"the XML ({root.tag}) has time records of {len(nodes)} signals, not of an input and an output",
            "configure the control to store the time series",
            part="TimeSeries",
            signals=len(nodes),
        )
    roles = child(root, "m_listPrimaryFreqRespSigNodeData")
    required = {
        number(roles, "m_iInputSigNodeUniqueInstanceID", deep=True): "input",
        number(roles, "m_iOutputSigNodeUniqueInstanceID", deep=True): "output",
    }
    named = {
        required.get(number(node, "m_iUniqueInstanceId"), f"node_{number(node, 'm_uNodeId'):.0f}"): node
        for node in nodes
    }
    if not {"input", "output"} <= named.keys():
        raise RecordingError(
            "incomplete",
            f"the XML names input and output {sorted(required)}, but has only {sorted(named)}",
            "check that the file is complete",
            part="PlatformSignalNode",
        )
    return {name: named[name] for name in sorted(named, key=lambda name: (name not in required.values(), name))}


def records(node: Element) -> Iterator[NDArray[np.float64]]:
    for series in node.iter("TimeSeries"):
        yield numeric_array(child(series, "m_ValueVector"), 1)


def spectrum(info: Element) -> NDArray[np.complex128]:
    return numeric_array(child(info, "m_ValueVector", deep=True), 2).view(np.complex128)


def numeric_array(element: Element, parts: int) -> NDArray[np.float64]:
    """Values of a NumericArray, `parts` doubles for each of its declared elements."""
    values = decode(child(element, "m_pNumberArray").text or "")
    declared = number(element, "m_length")
    if len(values) != parts * declared:
        raise truncated(f"an array declares {declared:.0f} values and has {len(values) / parts:g}", declared=declared)
    return values


def update_time_s(root: Element) -> float:
    period_s = number(root, "m_dProcessUpdateTime")
    if not 1e-9 < period_s < 1e3:
        raise damaged(f"the sampling interval m_dProcessUpdateTime is {period_s} s", period_s=period_s)
    return period_s


def child(element: Element, name: str, *, deep: bool = False) -> Element:
    """The part of `element` with this name; `deep` looks at all levels."""
    for part in element.iter() if deep else element:
        if part.get("name") == name:
            return part
    raise RecordingError(
        "incomplete",
        f"{element.get('name') or element.tag} has no {name}",
        "check that this is a complete Sinumerik measurement",
        part=name,
    )


def number(element: Element, name: str, *, deep: bool = False) -> float:
    text = (child(element, name, deep=deep).text or "").strip()
    try:
        return float(text)
    except ValueError:
        raise damaged(f"{name} is {text[:40]!r}, not a number", part=name, value=text[:40]) from None
