"""Live sources: machines that send their samples in batches. docs/how-to/live.md shows how to connect each."""

from livebode.sources.live.batch import Batch, LiveBlock
from livebode.sources.live.frame import FrameDecoder, encode_layout, encode_samples
from livebode.sources.live.health import Health
from livebode.sources.live.opening import checked_address, make_source, open_source
from livebode.sources.live.position import Origin, Position
from livebode.sources.live.sequencer import Sequencer
from livebode.sources.live.settings import SourceSettings
from livebode.sources.live.source import LiveSource
from livebode.sources.live.source_events import KINDS
from livebode.sources.live.spectra_batch import SpectraBatch
from livebode.sources.live.spectra_frame import encode_spectra, encode_spectra_layout

__all__ = [
    "KINDS",
    "Batch",
    "FrameDecoder",
    "Health",
    "LiveBlock",
    "LiveSource",
    "Origin",
    "Position",
    "Sequencer",
    "SourceSettings",
    "SpectraBatch",
    "checked_address",
    "encode_layout",
    "encode_samples",
    "encode_spectra",
    "encode_spectra_layout",
    "make_source",
    "open_source",
]
