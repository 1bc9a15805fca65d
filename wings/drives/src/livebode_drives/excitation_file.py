"""The excitation that `livebode design` wrote, for a PLC."""

from __future__ import annotations

import json
import os
import zipfile
import zlib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from livebode.core import Lines, RecordingError
from livebode.excitation import Waveform

_RAMP_S_MAX = 3600.0


def read_designed(path: Path) -> Waveform:
    """The excitation in an .npz of `livebode design`; `about` is its description in the file.

    Raises
    ------
    RecordingError
        If the file cannot be read, or is not written by `livebode design`.
    """
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as held:
            samples, frequency_hz, rate_hz = (_reals(held[key]) for key in ("samples", "frequency_hz", "rate_hz"))
            rate = float(rate_hz)
            about = json.loads(str(held["facts"]))
        bins = [round(f * samples.size / rate) for f in frequency_hz.tolist()]
        if max(bins) > samples.size or not 0 <= float(about.get("ramp_s", 0.0)) <= _RAMP_S_MAX:
            raise ValueError(bins, about)
        return Waveform(Lines.of_bins(bins, samples.size, rate), samples, dict(about))
    except FileNotFoundError:
        raise RecordingError("not-found", f"there is no file {path}", "check the name", path=str(path)) from None
    except OSError as error:
        why = os.strerror(error.errno) if error.errno else str(error)
        raise RecordingError(
            "not-readable",
            f"{str(path)!r} cannot be read: {why}",
            "check the path and its permissions",
            path=str(path),
        ) from None
    except (ValueError, KeyError, TypeError, AttributeError, EOFError, ArithmeticError, zipfile.BadZipFile, zlib.error):
        raise RecordingError(
            "not-an-excitation",
            f"{str(path)!r} is not an .npz file that `livebode design` wrote",
            "choose its excitation.npz",
            path=str(path),
        ) from None


def _reals(array: NDArray[np.generic]) -> NDArray[np.float64]:
    return array.astype(np.float64, casting="same_kind")
