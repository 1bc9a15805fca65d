"""PrometheusSink: the newest results of all axes as metrics, on a port of livebode."""

from __future__ import annotations

import threading
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any
from wsgiref.simple_server import WSGIServer

import numpy as np

from livebode import __version__
from livebode.core import not_installed
from livebode.publishing import AxisValues, EventMessage, PublishSection, address, cannot_listen, server_tls

if TYPE_CHECKING:
    from prometheus_client import Metric

_STATUS = {
    "samples": ("counter", "livebode_samples", "Samples that were tracked"),
    "responses": ("counter", "livebode_responses", "Responses that were published"),
    "lost": ("counter", "livebode_lost_samples", "Samples that the live source lost"),
    "rate_hz": ("gauge", "livebode_sample_rate_hertz", "Samples per second of the run"),
    "latency_s": ("gauge", "livebode_latency_seconds", "Longest time from the arrival of samples to their results"),
    "behind_s": ("gauge", "livebode_behind_seconds", "Samples that wait to be tracked"),
}
"""The numbers of the status: kind, name and description of each metric."""


class PrometheusSink:
    """A server that Prometheus reads. Its metrics are those of the last round; nothing waits while nobody reads."""

    events_at_once = 1
    pause_s = 0.0

    def __init__(self, section: PublishSection) -> None:
        try:
            import prometheus_client  # noqa: F401
        except ImportError:
            raise not_installed(
                "metrics for Prometheus need prometheus-client, which is not installed",
                "prometheus-client",
                "prometheus",
            ) from None
        self._section = section
        self._values: Sequence[AxisValues] = ()
        self._server: WSGIServer | None = None
        address(section), server_tls(section)

    def send_events(self, events: Sequence[EventMessage]) -> None:
        """Nothing: active alarms are among the metrics."""

    def send_values(self, values: Sequence[AxisValues]) -> None:
        """Serve these from now; PublishError if nothing can listen at the address."""
        self._values = values
        if self._server is None:
            self._server = self._started()

    def collect(self) -> Iterator[Metric]:
        """The metrics, for the library."""
        yield from metrics(self._values)

    def close(self) -> None:
        """Close the port."""
        if self._server is not None:
            self._server.shutdown()
            self._server.server_close()
            self._thread.join()
            self._server = None

    def _started(self) -> WSGIServer:
        from wsgiref.simple_server import make_server

        from prometheus_client import CollectorRegistry, make_wsgi_app
        from prometheus_client.exposition import ThreadingWSGIServer, _SilentHandler

        _, host, port, _ = address(self._section)
        registry = CollectorRegistry()
        registry.register(self)
        try:
            server = make_server(host, port, make_wsgi_app(registry), ThreadingWSGIServer, _SilentHandler)
        except OSError as error:
            raise cannot_listen(host, port, error) from None
        if (context := server_tls(self._section)) is not None:
            server.socket = context.wrap_socket(server.socket, server_side=True)
        self._thread = threading.Thread(target=server.serve_forever, args=(0.2,), name="livebode metrics", daemon=True)
        self._thread.start()
        return server


def metrics(values: Sequence[AxisValues]) -> Iterator[Metric]:
    """The results of these axes as metrics. Quantities are labels, because each model has its own."""
    from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, InfoMetricFamily

    yield InfoMetricFamily("livebode", "Version of livebode", value={"version": __version__})
    quantity = ["axis", "machine", "name", "unit"]
    parameter = GaugeMetricFamily("livebode_parameter", "Newest value of a parameter or margin", labels=quantity)
    bound = GaugeMetricFamily("livebode_parameter_bound", "Half-width of its 95 % interval", labels=quantity)
    state = GaugeMetricFamily("livebode_axis_state", "1 for the state of the axis", labels=["axis", "machine", "state"])
    alarm = GaugeMetricFamily(
        "livebode_alarm", "1 for each active alarm", labels=["axis", "machine", "cause", "kind", "priority"]
    )
    response_time = GaugeMetricFamily(
        "livebode_result_timestamp_seconds", "Effective time of the newest response", labels=["axis"]
    )
    numbers = {
        name: (CounterMetricFamily if kind == "counter" else GaugeMetricFamily)(
            metric, about, labels=["axis", "machine"]
        )
        for name, (kind, metric, about) in _STATUS.items()
    }
    for axis_values in values:
        own = [axis_values.axis, axis_values.machine]
        response_time.add_metric([axis_values.axis], axis_values.unix_s)
        for measured in axis_values.measurements:
            if measured.value is not None:
                parameter.add_metric([*own, measured.name, measured.unit], measured.value)
            if measured.value is not None and measured.bound is not None:
                bound.add_metric([*own, measured.name, measured.unit], measured.bound)
        for active in axis_values.alarms:
            alarm.add_metric([*own, active.cause, active.kind, active.priority], 1)
        for name, value in axis_values.status.items():
            if name == "state":
                state.add_metric([*own, str(value)], 1)
            elif name in numbers:
                numbers[name].add_metric(own, float(value))
    yield from (parameter, bound, state, alarm, response_time, *numbers.values(), *_responses(values))


def _responses(values: Sequence[AxisValues]) -> Iterator[Metric]:
    """Magnitude and phase at each valid line."""
    from prometheus_client.core import GaugeMetricFamily

    labels = ["axis", "machine", "quantity", "unit", "frequency_hz"]
    magnitude = GaugeMetricFamily("livebode_response_magnitude", "Magnitude at a line", labels=labels)
    phase = GaugeMetricFamily("livebode_response_phase_radians", "Phase at a line", labels=labels)
    for axis_values in values:
        for frequency_hz, value in _valid(axis_values.response or {}):
            of = [axis_values.axis, axis_values.machine, axis_values.quantity, axis_values.unit, f"{frequency_hz:.9g}"]
            magnitude.add_metric(of, abs(value))
            phase.add_metric(of, float(np.angle(value)))
    yield from (magnitude, phase)


def _valid(response: Mapping[str, Sequence[Any]]) -> Iterator[tuple[float, complex]]:
    columns = [response.get(name, ()) for name in ("frequency_hz", "real", "imag", "valid")]
    for frequency_hz, real, imag, valid in zip(*columns):
        if valid and real is not None and imag is not None:
            yield frequency_hz, complex(real, imag)
