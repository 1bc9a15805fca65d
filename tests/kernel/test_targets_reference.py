"""The kernel on a Cortex-M4F (float32) and a Cortex-M7 (float64) makes the bits of the host's build."""

import numpy as np
import pytest

from livebode import open_log
from tests.support.real_recordings import recording
from tests.support.targets import VARIANTS, Job, need_tools, on_host, on_target, replay
from tools.firmware import M4F, M7

SHAPES = [
    (1, (0,)),
    (2, (1, 0)),
    (3, (2, 0)),
    (7, (1, 2, 3)),
    (100, tuple(range(1, 8))),
    (128, (5,)),
    (129, (0, 64, 128)),
]


def noise(seed, count, channels=2, offset=0.0):
    return np.random.default_rng(seed).standard_normal((count, channels)) + offset


@pytest.fixture(scope="module", params=[M4F, M7], ids=lambda core: core.name)
def target(request, tmp_path_factory):
    need_tools()
    core = request.param
    return core, replay(core, tmp_path_factory.mktemp(core.name))


def bits(numbers):
    """As integers, so that a zero's sign counts; every NaN as one, for processors differ in which NaN they make."""
    parts = np.ascontiguousarray(numbers).view(np.empty(0, numbers.dtype).real.dtype).copy()
    parts[np.isnan(parts)] = np.nan
    return parts.view(f"u{parts.itemsize}")


def check(target, jobs):
    core, program = target
    for job, made in zip(jobs, on_target(core, program, jobs), strict=True):
        host = on_host(job, f"float{core.bits}")
        assert np.array_equal(bits(made.rows), bits(host.rows)), job
        if np.isfinite(job.samples[-2 * job.window :]).all():
            assert made.snapshot == host.snapshot, job
        yield job, made


def test_every_output_and_snapshot_has_the_hosts_bits(target):
    jobs = [
        Job(
            noise(window, 3 * window + 5, 1 + window % 3),
            window,
            bins,
            hop,
            phase,
            compact=compact,
            blockwise=blockwise,
        )
        for window, bins in SHAPES
        for phase, hop, compact, blockwise in [
            ("window", 1, False, False),
            ("fixed", 3, True, False),
            ("window", 3, True, True),
            ("fixed", 1, False, True),
        ]
    ]
    assert len(list(check(target, jobs))) == 4 * len(SHAPES)


def test_the_drives_sizes_with_offsets(target):
    """N = 400 with 7 and 21 lines: two channels as they are, with an offset of 100, and at both ends of the range."""
    jobs = [
        Job(scale * noise(k, 1300, offset=offset), 400, tuple(range(2, 2 + 2 * k, 2)), 20, compact=compact)
        for k in (7, 21)
        for compact in (False, True)
        for scale, offset in ((1.0, 0.0), (1.0, 100.0), (1e-39, 0.0), (1e30, 0.0))
    ]
    assert len(list(check(target, jobs))) == 16


@pytest.mark.parametrize("variant", VARIANTS)
def test_every_variant_has_the_bits_of_the_host(target, variant):
    jobs = [
        Job(noise(compact, 130), 40, (1, 2, 7, 8), 3, phase, variant, compact=compact)
        for phase in ("window", "fixed")
        for compact in (False, True)
    ]
    assert len(list(check(target, jobs))) == 4


def test_spectra_at_a_hop_have_the_bits_of_the_host(target):
    """Sample by sample and in blocks, from the beginning, from the middle of a hop, and after a NaN."""
    jobs = [
        Job(noise(hop, 333, channels), 120, bins, every * hop, phase, blockwise=blockwise, before=before, own_hop=hop)
        for hop, every in ((1, 5), (8, 1), (15, 2), (60, 1), (120, 1))
        for channels, bins, phase in ((1, (0, 7), "window"), (2, tuple(range(1, 22)), "fixed"))
        for blockwise in (False, True)
        for before in (np.zeros((0, channels)), noise(9, 131, channels))
    ]
    jobs[0].samples[70] = np.nan
    assert len(list(check(target, jobs))) == 40


def test_a_nan_heals_on_the_target(target):
    """What is not finite spoils the same rows as on the host, and none after 2N samples."""
    jobs = []
    for compact in (False, True):
        samples = noise(3, 330)
        samples[70, 0], samples[71, 1] = np.nan, np.inf
        jobs.append(Job(samples, 50, (1, 2, 3), 1, compact=compact))
    for _, made in check(target, jobs):
        finite = np.isfinite(made.rows).all(axis=(0, 2))
        assert not finite[70]
        assert finite[71 + 2 * 50 :].all()


def test_the_target_continues_from_the_snapshot_of_the_host(target):
    jobs = [
        Job(noise(5, 230), 100, (3, 4, 9), 7, compact=compact, before=noise(4, before))
        for compact in (False, True)
        for before in (1, 49, 50, 51, 99, 100, 260)
    ]
    assert len(list(check(target, jobs))) == 14


def test_a_real_recording_gives_the_bits_of_the_host(target):
    """Two periods and a bit of the motor bench, its position drifting: windows of 2,500 samples, 40 lines."""
    log = open_log(recording("motorbench/MultisineTypeA.mat"))
    samples = next(iter(log.blocks(["iq_adx", "theta_mx"]))).data[:, :5600].T
    jobs = [Job(samples, 2500, tuple(range(11, 51)), 500, compact=compact) for compact in (False, True)]
    assert [made.rows.shape for _, made in check(target, jobs)] == [(2, 11, 40)] * 2
