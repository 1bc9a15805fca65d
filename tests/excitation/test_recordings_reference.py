"""What is known about real recordings is found in them."""

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat

from livebode.core import SignalError
from livebode.excitation import recognise
from tests.support.errors import refused

DATA = Path(__file__).parents[3] / "shared" / "data"
pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason="the real recordings (../shared/data) are not here")


@pytest.fixture(scope="module")
def bench():
    return {k: v.ravel() for k, v in loadmat(DATA / "motorbench/MultisineTypeA.mat").items() if k[1] in "qhm"}


@pytest.mark.parametrize("channel", ["iq_refx", "iq_adx"])
def test_the_period_and_lines_of_the_motor_bench_are_found(bench, channel):
    found = recognise(bench[channel].astype(float), 2500, bench["theta_mx"])
    assert (found.period, found.periods, found.start, found.stop) == (2500, 20, 0, 50000)
    assert found.lines.bins == tuple(range(11, 251))
    assert found.transient == (0,)
    assert 3 not in found.outlying
    strongest = found.lines.bins[int(np.argmax(found.snr_db))]
    assert 11 <= strongest <= 80
    assert found.snr_db.shape == (240,)
    assert np.all(found.snr_db > 10)


def test_the_crest_factors_of_reference_and_current_of_the_motor_bench_are_known(bench):
    reference, current = recognise(bench["iq_refx"], 2500), recognise(bench["iq_adx"], 2500)
    assert reference.crest_factor == pytest.approx(1.39, abs=0.01)
    assert reference.distortion == ()
    assert current.distortion  # of the inverter
    assert 7 in current.outlying  # the largest current spike
    assert reference.outlying == (19,)  # its last sample is another


def test_the_pulses_of_emps_are_found_in_input_and_response():
    pulses = loadmat(DATA / "emps/DATA_EMPS_PULSES.mat")
    plain = loadmat(DATA / "emps/DATA_EMPS.mat")
    found = recognise(pulses["pulses_N"].ravel(), 1000, (pulses["qm"] - plain["qm"]).ravel())
    assert (found.period, found.periods) == (1000, 24)
    assert found.lines.bins == tuple(range(1, 500, 2))
    assert found.crest_factor == pytest.approx(1)
    response = recognise((pulses["vir"] - plain["vir"]).ravel(), 1000)
    assert response.period == 1000
    assert all(k % 2 for k in response.lines.bins)


def prbs_records():
    digits = "0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ!#$`()*+-/:;=?@[]^_{|}~"
    for series in ET.parse(DATA / "sinumerik/freq_trace.XML").iter("TimeSeries"):
        text, at, out = "".join(series.findtext("NumericArray/raw").split()), 0, b""
        while at < len(text):
            step = 1 if text[at] == "." else 5
            value = 0
            for digit in text[at : at + step] if step == 5 else "":
                value = 85 * value + digits.index(digit)
            out += value.to_bytes(4, "big")
            at += step
        yield np.frombuffer(out, ">f8").astype(float)


def test_the_prbs_of_a_spindle_is_found_in_both_directions():
    """One period in each direction: each alone is refused; the second with its sign turned is a second period."""
    first, second = (x for x in prbs_records() if np.unique(x).size == 2)
    for record in (first, second):
        assert record.size == 2047
        with refused(SignalError, "not-periodic"):
            recognise(record, 8000)
    found = recognise(np.concatenate((first, -second)), 8000)
    assert (found.period, found.periods) == (2047, 2)
    assert found.lines.bins == tuple(range(1, 1024))
    assert found.crest_factor == pytest.approx(1, abs=1e-3)
