"""A snapshot that is not whole or not one's own is refused, and leaves the object as it was."""

import numpy as np
import pytest

from livebode.kernel import SlidingDFT

OWN = {"window": 20, "bins": [1, 4], "channels": 2}


def advanced(**changes) -> SlidingDFT:
    dft = SlidingDFT(**{**OWN, **changes})
    dft.advance(np.random.default_rng(0).standard_normal((dft.channels, 77)))
    return dft


@pytest.mark.parametrize(
    "changes",
    [
        {"window": 21},
        {"bins": [4, 1]},
        {"bins": [1, 5]},
        {"bins": [1, 4, 5]},
        {"channels": 3},
        {"dtype": "float32"},
        {"variant": "hann"},
        {"variant": "plain"},
        {"variant": "damped"},
    ],
)
def test_a_snapshot_of_another_configuration_is_refused(changes):
    with pytest.raises(ValueError, match="the snapshot is of another window, bins, channels, dtype, variant or hop"):
        advanced().restore(advanced(**changes).snapshot())


def test_a_snapshot_of_another_damping_is_refused():
    one, other = (advanced(variant="damped", damping=r) for r in (0.9, 0.8))
    with pytest.raises(ValueError, match="another window"):
        one.restore(other.snapshot())


def test_every_flipped_byte_is_found():
    dft = advanced()
    whole, before = dft.snapshot(), dft.spectrum()
    for i in range(len(whole)):
        damaged = whole[:i] + bytes([whole[i] ^ 0x10]) + whole[i + 1 :]
        with pytest.raises(ValueError, match="snapshot"):
            dft.restore(damaged)
    assert np.array_equal(dft.spectrum(), before)
    assert dft.snapshot() == whole


def test_every_cut_and_every_addition_is_found():
    dft = advanced()
    whole = dft.snapshot()
    for length in range(len(whole)):
        with pytest.raises(ValueError, match="snapshot"):
            dft.restore(whole[:length])
    with pytest.raises(ValueError, match="snapshot"):
        dft.restore(whole + b"\0")
    assert dft.snapshot() == whole


def test_a_snapshot_that_is_not_bytes_is_refused():
    for thing in ("text", None, 3, [1, 2]):
        with pytest.raises(TypeError):
            advanced().restore(thing)


def test_a_fresh_object_may_be_restored_too():
    empty, dft = SlidingDFT(**OWN), advanced()
    fresh = empty.snapshot()
    dft.restore(fresh)
    assert dft.count == 0
    assert dft.snapshot() == fresh
