"""What this package adds to livebode; the modules with the work are loaded when they are used."""

from livebode.analysis import Analysis
from livebode.cli import Command
from livebode.publishing import SinkKind
from livebode.sources import Format
from livebode.sources.live import SourceKind

FORMATS = (
    Format("trace", (".trace",), lambda head: head.startswith(b"TRACE1 "), "livebode_trace.reader:TraceRecording"),
)
SOURCES = {"trace": SourceKind("livebode_trace.source:TraceSource", frozenset(), device="trace:/data/axis.trace")}
SINKS = {"datagram": SinkKind("livebode_trace.sink:DatagramSink", {"udp": None}, frozenset({"events"}), values=())}
COMMANDS = {"trace": Command("Print rate and channels of a trace.", "livebode_trace.command:trace_command")}
ANALYSES = {"trace-duration": Analysis("livebode_trace.command:duration_s")}
