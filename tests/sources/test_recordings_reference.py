"""Real recordings read with the facts that are known of them. They are beside the project, not in it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from livebode.sources import open_log
from livebode_drives.recordings.sinumerik import sinumerik_spectra

DATA = Path(__file__).parents[2].parent / "shared" / "data"
pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason=f"the real recordings are not in {DATA}")


def joined(log, *names):
    return np.concatenate([block.data for block in log.blocks(names, block_samples=999)], axis=1)


def test_the_motor_bench_has_the_known_rate_and_samples():
    log = open_log(DATA / "motorbench" / "MultisineTypeA.mat")
    assert (log.rate_hz, log.samples, log.timing.unit, log.timing.gaps) == (2500, 50_000, "us", 0)
    assert "'fs' in the file" in log.rate_origin
    reference, measured = joined(log, "iq_refx", "iq_adx")
    assert measured.std() == pytest.approx(reference.std(), rel=0.2)
    period = open_log(DATA / "motorbench" / "MultisineTypeA.mat", channels=["ref"])
    ref = joined(period, "ref")[0]
    np.testing.assert_allclose(reference[2500:4999], 10 * ref[1:], atol=1e-2)  # one sample in advance


def test_motorbench_with_its_rate_given():
    assert open_log(DATA / "motorbench" / "MultisineTypeA.mat", rate_hz=2500).timing.unit == "us"


@pytest.mark.parametrize("name", ["DATA_EMPS.mat", "DATA_EMPS_PULSES.mat"])
def test_emps_obeys_its_controller(name):
    log = open_log(DATA / "emps" / name)
    assert (log.rate_hz, log.samples) == (1000, 24_841)
    assert log.timing.period_s_std < 1e-7
    qg, qm, vir = joined(log, "qg", "qm", "vir")
    kp, kv = log.scalars["kp"], log.scalars["kv"]
    dq = 1000 * np.diff(0.5 * (qm[1:] + qm[:-1]))
    vir = vir - 1.014 * joined(log, "pulses_N")[0] if "PULSES" in name else vir
    rest = kp * kv * (qg - qm)[2:] - kv * dq - vir[2:]
    assert np.median(np.abs(rest)) < 0.01 * vir.std()


def test_sinumerik_h1_is_what_the_control_computed():
    path = DATA / "sinumerik" / "freq_trace.XML"
    log, spectra = open_log(path), sinumerik_spectra(path)
    blocks = list(log.blocks(["input", "output"]))
    assert [(block.start, len(block), block.gap) for block in blocks] == [(0, 2047, False), (2047, 2047, True)]
    assert (log.rate_hz, log.rate_origin) == (8000, "metadata")
    U, Y = (np.fft.fft([block[name] for block in blocks], axis=1) for name in ("input", "output"))
    h1 = (Y * U.conj()).sum(axis=0) / (np.abs(U) ** 2).sum(axis=0)
    stored = np.conj(spectra.cross / spectra.input_auto)
    bins = np.arange(1, 301)
    assert np.abs(h1[bins] - stored[bins]).max() <= 1e-12  # |T| is 1 at low frequency
    # The magnitudes that are known of this axis, at the bins next to 19.5, 50.8 and 101.6 Hz.
    np.testing.assert_allclose(20 * np.log10(np.abs(h1[[5, 13, 26]])), [-0.21, -2.23, -6.06], atol=0.005)
    assert spectra.frequency_hz[1] == pytest.approx(8000 / 2044, rel=1e-9)
