"""Klipper's accelerometer and moves become samples of one clock whose response is that of the machine."""

from __future__ import annotations

import json

import numpy as np
import pytest

from livebode.core import ConfigError, SourceError
from livebode.sources.live import SourceSettings, make_source
from livebode_drives.live.klipper import MOVES_MAX, WAIT_S, Moves
from livebode_drives.live.on_grid import OnGrid
from tests.support.errors import refused
from tests.support.peers.klipper import COMMAND, MOVE_S, PERIOD_S, Printer, response
from tests.support.peers.peer import PATIENCE_S, fed, until

RATE_HZ = 3200.0
WINDOW = round(RATE_HZ * PERIOD_S)


def until_s(source, time_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Print times and samples, up to a print time."""
    times, data = [], []
    for block in source.blocks():
        first = block.start + block.origin.offset
        times.append(np.arange(first, first + len(block)) / RATE_HZ)
        data.append(block.data)
        if times[-1][-1] >= time_s:
            break
    return np.concatenate(times), np.concatenate(data, axis=1)


def test_the_response_is_that_of_the_printer(tmp_path):
    """The accelerometer's clock is 0.4 % fast, and moves come up to half a second after the samples of their time."""
    with Printer(tmp_path) as printer:

        def script():
            printer.wait_ready()
            printer.run(30)

        with fed(printer, script) as source:
            assert (source.channels[0].unit, source.channels[0].source_unit) == ("m/s²", "mm/s^2")
            assert source.rate_hz == RATE_HZ
            time_s, data = until_s(source, 102.4)
            data = 1e3 * data  # in mm/s²
            assert source.health.lost == 0
            assert [event.kind for event in source.take_events()] == ["connected"]
    np.testing.assert_allclose(np.diff(time_s), 1 / RATE_HZ)
    begin = round(PERIOD_S * RATE_HZ) - round(time_s[0] * RATE_HZ) % WINDOW
    command, accel = data[0, begin : begin + 2 * WINDOW], data[3, begin : begin + 2 * WINDOW]
    place = time_s[begin : begin + 2 * WINDOW] / MOVE_S
    piece = np.rint(place - 0.5).astype(int) % len(COMMAND)
    inside = np.abs(place - np.rint(place)) > 4 / (MOVE_S * RATE_HZ)
    np.testing.assert_allclose(command[inside], COMMAND[piece][inside], atol=1e-3)
    lines = np.arange(2, 161, 2)  # moves of 5 ms excite nothing at 200 Hz
    f_hz = lines / (2 * PERIOD_S)
    found = np.fft.rfft(accel)[lines] / np.fft.rfft(command)[lines]
    error = np.abs(found / response(f_hz) - 1)
    assert np.max(error) < 3e-3
    assert np.median(error) < 3e-4
    np.testing.assert_allclose(data[5], 9810.0)


@pytest.mark.parametrize(("part", "error"), [(1 / 16, 2e-5), (1 / 8, 1e-3)])
def test_interpolation_is_as_good_as_it_says(part, error):
    rate_hz = 3213.7
    time_s = np.arange(4000) / rate_hz
    grid, found = OnGrid(RATE_HZ, 1), []
    for a in range(0, 4000, 321):
        found += grid.process(time_s[a : a + 321], np.cos(2 * np.pi * part * rate_hz * time_s[None, a : a + 321]))
    numbers = np.concatenate([first + np.arange(values.shape[1]) for first, values in found])
    np.testing.assert_array_equal(np.diff(numbers), 1)
    truth = np.cos(2 * np.pi * part * rate_hz * numbers / RATE_HZ)
    assert np.max(np.abs(np.concatenate([values[0] for _, values in found]) - truth)) < error


def test_nothing_is_interpolated_across_missing_samples():
    time_s = np.delete(np.arange(400) / RATE_HZ, slice(200, 230))
    runs = OnGrid(RATE_HZ, 1).process(time_s, time_s[None] * RATE_HZ)
    assert [(first, values.shape[1]) for first, values in runs] == [(2, 195), (232, 165)]
    for first, values in runs:
        np.testing.assert_allclose(values[0], first + np.arange(values.shape[1]))


def test_an_overflow_and_a_restart_are_gaps_and_a_late_move_is_reported(tmp_path):
    with Printer(tmp_path) as printer:

        def script():
            printer.wait_ready()
            printer.run(10)
            printer.overflows = 1  # samples are missing where it overflowed
            printer.time_s += 0.01
            printer.run(10)
            for _ in range(round(WAIT_S / 0.1) + 10):
                printer.measure()  # Klipper sends no moves for too long
            printer.move()
            printer.write(
                b"{ no JSON \x03" + b"[1]\x03" + json.dumps({"of": 0, "params": {"data": [[1]]}}).encode() + b"\x03"
            )
            printer.hang_up()
            printer.time_s = printer._moved_s = 5.0  # print time begins again with the microcontroller
            printer.wait_ready()
            printer.run(15)

        with fed(printer, script) as source:
            epochs = {}
            for block in source.blocks():
                epochs.setdefault(block.origin.epoch, []).append(block)
                if 1 in epochs and sum(map(len, epochs[1])) > 0.8 * RATE_HZ:
                    break
            events = source.take_events()
    kinds = [event.kind for event in events]
    assert kinds.count("restart") == 1
    loss = next(event for event in events if event.kind == "loss")
    assert 32 <= loss.details["missing_samples"] <= 32 + 6
    text = " ".join(event.message for event in events if event.kind == "malformed")
    for words in ("overflowed (1 times", "a move came", "not a JSON object", "no rows of time, x_acceleration"):
        assert words in text
    assert kinds.count("disconnected") == 1


def test_a_printer_that_is_not_ready_is_asked_again(tmp_path):
    with Printer(tmp_path) as printer:
        error = {"error": {"message": "Printer is not ready", "error": "WebRequestError"}}
        printer.answers = {"adxl345/dump_adxl345": error}
        source = make_source(SourceSettings(**printer.settings, timeout_s=PATIENCE_S))
        source._thread.start()
        until(lambda: source.health.counts["disconnected"], "the refusal")
        printer.answers = {}
        until(lambda: source.health.connected, "the second answer")
        message = source.take_events()[0].message
        source.close()
    assert "Klipper rejects the request: 'Printer is not ready'" in message


def test_a_rate_far_from_that_of_the_accelerometer_is_refused(tmp_path):
    with Printer(tmp_path) as printer:
        source = make_source(SourceSettings(**printer.settings, timeout_s=PATIENCE_S, rate_hz=1000.0))
        source._thread.start()
        printer.wait_ready()
        printer.measure()
        until(lambda: source._refused, "the refusal")
        source.close()
        with refused(SourceError, "refused", rate_hz=1000.0):
            raise source._refused


def test_moves_are_bounded_and_a_wrong_section_is_refused():
    moves = Moves()
    moves.add([[k * 0.01, 0.01, 0.0, 1.0, [0, 0, 0], [1, 0, 0]] for k in range(MOVES_MAX + 10)])
    assert len(moves._moves) == MOVES_MAX
    for rows in (3, [3], [[1, 2, 3]], [[0, -1, 0, 0, 0, [1, 0, 0]]], [[0, 1, 0, float("nan"), 0, [1, 0, 0]]], "text"):
        with refused(SourceError, "value-invalid", key="data"):
            moves.add(rows)
    with refused(ConfigError, "value-invalid", key="source.accelerometer", value="bed adxl345"):
        make_source(SourceSettings(url="klipper:/tmp/klippy_uds", accelerometer="bed adxl345"))
