"""[lines]: the excited frequencies and the window."""

from __future__ import annotations

from typing import Literal

from livebode.configuration.section import ConfigurationSection


class LinesSection(ConfigurationSection):
    """[lines]: the excited frequencies and the window.

    Parameters
    ----------
    frequencies
        Excited lines in Hz as start:stop:step or single values, joined by commas: "20:140:20, 175"; "k=1:300" counts in
        bins of the window. "auto": from the excitation of the recording.
    window
        Length of the window in samples. "auto": the measured period of the excitation.
    """

    frequencies: str = "auto"
    window: int | Literal["auto"] = "auto"
