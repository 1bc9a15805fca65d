"""Tables of oscilloscopes and recorders: names, units and time as the instrument wrote them, and every sample.

The layouts are those of the makers' manuals and of files that users publish; the values are those of the test.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from livebode.core import RecordingError
from livebode.sources import open_log
from tests.support.command import livebode

SAMPLES, RATE_HZ = 600, 1000
TIME_S = -0.25 + np.arange(SAMPLES) / RATE_HZ
A = np.round(np.sin(2 * np.pi * 20 * TIME_S), 4)
B = np.round(3 * np.cos(2 * np.pi * 20 * TIME_S), 4)


def rows(line: str) -> str:
    return "".join(line.format(t=t, ms=1000 * t, a=a, b=b, n=n) for n, (t, a, b) in enumerate(zip(TIME_S, A, B)))


SIGLENT = """Record Length,Analog:6.00E+02
Sample Interval,CH1:1.0E-03
Vertical Units,CH1:V,CH2:V
Vertical Scale,CH1:1.00,CH2:1.00
Horizontal Units,s
Model Number,SDS1204X-E
Source,CH1,CH2
Second,Volt,Volt
"""
TEKTRONIX = """Model,MDO3024
Firmware Version,1.26

Waveform Type,ANALOG,,
Point Format,Y,,
Horizontal Units,s,,
Horizontal Scale,0.004,,
Sample Interval,1e-03,,
Gating,0.0% to 100.0%,,
Probe Attenuation,10,1,
Vertical Units,V,A,
Vertical Offset,0,0,
Vertical Scale,5,0.1,
,,,
Label,,,
TIME,CH1,CH2,
"""
YOKOGAWA = """"Model Name","DL850"
"BlockNumber",1
"TraceName","Force","Accel"
"BlockSize",600,600
"VUnit","N","g"
"SampleRate",1.0000000E+03,1.0000000E+03
"HUnit","s","s"
"Date","2014/01/01","2014/01/01"
"Time","12:00:00.000","12:00:00.000"
"""
HIOKI = """"File Name","AUTO0001.CSV","V 1.00"
"Trigger Time","19-07-22 22:55:01"
"CH","CH1-1","CH1-2"
"Mode","Voltage","Voltage"
"Range","10V","10V"
"Ratio","+1.0","+1.0"
"Time","CH1-1[V]","CH1-2[V]"
"""
LABVIEW = """D:\\rig\\run0.txt
Programmer - None
Sampling Frequency - 1000
Tue, Jul 19, 2022 10:55 PM
Force\tAccel\tTime
Voltage (unscaled)\tVoltage (unscaled)\tSec
0.0 0.0 0\t\t0.0 0.0 0

"""
LECROY = """LECROYWR64Xi,12345,Waveform
Segments,1,SegmentSize,600
Segment,TrigTime,TimeSinceSegment1
#1,25-Nov-2014 11:41:55,0
Time,Ampl
"""
PLAIN = "{t:.6E},{a:.4f},{b:.4f}\n"
VOLTS = {"1": "Volt", "2": "Volt"}
INSTRUMENTS = {
    "Keysight": ("x-axis,1,2\nsecond,Volt,Volt\n", PLAIN, VOLTS),
    "Keysight, different units": ("x-axis,1,2\nsecond,Volt,Ampere\n", PLAIN, {"1": "Volt", "2": "Ampere"}),
    "Rigol": (
        "X,CH1,CH2,Start,Increment,\nSequence,Volt,Volt,-2.5e-01,1.0e-03\n",
        "{n},{a:.4e},{b:.4e},,\n",
        {"CH1": "Volt", "CH2": "Volt"},
    ),
    "Rigol, newer": (
        "Time(s),CH1(V),CH2(V),t0 = -0.25, tInc = 1e-03,\n",
        ",{a:.4e},{b:.4e},,\n",
        {"CH1": "V", "CH2": "V"},
    ),
    "Siglent": (SIGLENT, PLAIN, {"CH1": "Volt", "CH2": "Volt"}),
    "Tektronix": (TEKTRONIX, "{t:.6e},{a:.4f},{b:.4f},\n", {"CH1": "", "CH2": ""}),
    "Yokogawa": (YOKOGAWA, ",{a:.4E},{b:.4E}\n", {"Force": "N", "Accel": "g"}),
    "Hioki": (HIOKI, "{t:+.6E},{a:+.4E},{b:+.4E}\n", {"CH1-1": "V", "CH1-2": "V"}),
    "LabVIEW": (
        LABVIEW,
        "{a:.4E}\t{b:.4E}\t{t:.6E}\n",
        {"Force": "Voltage (unscaled)", "Accel": "Voltage (unscaled)"},
    ),
    "PicoScope": (
        "Time,Channel A,Channel B\n(ms),(V),(mV)\n\n",
        "{ms:.6f},{a:.4f},{b:.4f}\n",
        {"Channel A": "V", "Channel B": "mV"},
    ),
    "Rohde & Schwarz": ("in s,C1 in V,C2 in V\n", PLAIN, {"C1": "V", "C2": "V"}),
    "Digilent": (
        "#Digilent WaveForms Oscilloscope Acquisition\n#Sample rate: 1000Hz\n\nTime (s),Channel 1 (V),Channel 2 (V)\n",
        PLAIN,
        {"Channel 1": "V", "Channel 2": "V"},
    ),
    "LeCroy": (LECROY, "{t:.6f},{a:.4f}\n", {"Ampl": ""}),
}


@pytest.mark.parametrize("instrument", INSTRUMENTS)
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_the_table_of_an_instrument_has_its_names_units_rate_and_all_samples(
    instrument: str, end: str, tmp_path: Path
) -> None:
    head, line, units = INSTRUMENTS[instrument]
    path = tmp_path / "scope.csv"
    path.write_bytes((head + rows(line)).replace("\n", end).encode())
    log = open_log(path)
    assert log.rate_hz == RATE_HZ
    found = {channel.name: channel.source_unit for channel in log.channels}
    assert units.items() <= found.items()
    data = np.concatenate([block.data for block in log.blocks(list(units))], axis=1)
    factors = [[channel.factor] for channel in log.channels if channel.name in units]
    np.testing.assert_allclose(data / factors, [A, B][: len(units)], atol=1e-9)


def test_a_column_without_a_name_that_rises_evenly_is_offered_as_the_time_and_the_offer_works(tmp_path: Path) -> None:
    for name, line, offer in (
        ("s", "{t:.4f} {a:.4f} {b:.4f}\n", "c1 [s]"),
        ("ms", "{ms:.1f},{a:.4f},{b:.4f}\n", "c1 [ms]"),
    ):
        path = tmp_path / f"{name}.txt"
        path.write_text(rows(line))
        with pytest.raises(RecordingError, match="'c1' rises evenly") as caught:
            open_log(path)
        assert caught.value.facts["time"] == offer
        assert open_log(path, time=offer).rate_hz == RATE_HZ


def test_a_signal_is_not_offered_as_the_time(tmp_path: Path) -> None:
    path = tmp_path / "log.txt"
    path.write_text(rows("{a:.4f} {b:.4f}\n"))
    with pytest.raises(RecordingError, match="give rate_hz, or name the time column"):
        open_log(path)


@pytest.mark.parametrize("head", ["Frequency (Hz),Magnitude (dB)", "f,|G|\nHz,dB", "Freq,Mag"])
def test_a_spectrum_is_reported_as_one(head: str, tmp_path: Path) -> None:
    path = tmp_path / "spectrum.csv"
    path.write_text(head + "\n" + "".join(f"{f:.3f},{-20 * np.log10(f):.3f}\n" for f in np.geomspace(1, 400, 125)))
    result = livebode("inspect", path)
    assert (result.code, result.out) == (2, "")
    assert "is a spectrum over 'F" in result.err or "is a spectrum over 'f'" in result.err
    assert open_log(path, rate_hz=10).samples is None  # who states a rate is believed


def test_results_in_json_are_reported_as_such(tmp_path: Path) -> None:
    frequency_hz = np.arange(1.0, 126.0)
    for number, content in enumerate(
        ({"frequency_hz": frequency_hz.tolist(), "gain": 1.0}, [{"f": f} for f in frequency_hz], [[1, 2], [3, 4]])
    ):
        path = tmp_path / f"results{number}.json"
        path.write_text(json.dumps(content, indent=number or None))
        result = livebode("inspect", path)
        assert (result.code, "is not a recording, but JSON" in result.err) == (2, True)
