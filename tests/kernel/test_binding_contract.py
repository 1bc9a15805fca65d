"""The Python face: shapes, types, strides, buffers, threads."""

import sys
import sysconfig
import threading

import numpy as np
import pytest

import livebode.simulation.source
from livebode.kernel import SlidingDFT, instruction_set, instruction_sets


def test_attributes_are_read_only():
    dft = SlidingDFT(100, (3, 1, 2), channels=2, dtype="float32", variant="hann")
    assert (dft.window, dft.channels, dft.count, dft.variant) == (100, 2, 0, "hann")
    assert dft.bins.tolist() == [3, 1, 2]
    assert dft.dtype == np.float32
    assert repr(dft) == "SlidingDFT(window=100, bins=[3, 1, 2], channels=2, dtype=float32, variant='hann')"
    for name in ("window", "bins", "channels", "dtype", "count", "variant", "instruction_set"):
        with pytest.raises(AttributeError):
            setattr(dft, name, 1)
    with pytest.raises(ValueError, match="read-only"):
        dft.bins[0] = 1
    with pytest.raises(AttributeError):
        dft.windw = 1


@pytest.mark.parametrize(("dtype", "result"), [("float64", np.complex128), ("float32", np.complex64)])
def test_outputs_have_the_shape_and_type_of_the_configuration(dtype, result):
    one, two = SlidingDFT(10, [1, 2, 3], dtype=dtype), SlidingDFT(10, [1, 2, 3], 2, dtype)
    assert one.process(np.zeros(25), 10).shape == (2, 3)
    assert one.process(np.zeros((1, 25)), 10).shape == (1, 3, 3)
    assert two.process(np.zeros((2, 25)), 10).shape == (2, 2, 3)
    assert (one.spectrum().shape, two.spectrum().shape) == ((3,), (2, 3))
    for z in (one.process(np.zeros(3)), two.process(np.zeros((2, 3))), one.spectrum(), two.spectrum()):
        assert z.dtype == result
    assert two.process(np.zeros((2, 0))).shape == (2, 0, 3)
    assert one.push(1.0) is None
    assert one.advance(np.zeros(3)) is None


def test_rows_fall_on_multiples_of_the_hop_since_the_start():
    dft = SlidingDFT(4, [1])
    counts = [len(dft.process(np.zeros(n), 5)) for n in (4, 1, 3, 3, 9)]
    assert counts == [0, 1, 0, 1, 2]
    assert dft.count == 20


@pytest.mark.parametrize("given", [np.int16, np.uint8, np.int64, np.float16, np.float32, np.longdouble, bool])
def test_any_real_dtype_is_converted(given):
    x = np.array([1, 0, 1, 1, 0, 1], given)
    assert np.array_equal(SlidingDFT(4, [1]).process(x), SlidingDFT(4, [1]).process(x.astype(float)))


def test_lists_strided_reversed_and_swapped_input():
    rng = np.random.default_rng(0)
    x = rng.standard_normal((2, 60))
    wide = np.zeros((4, 180))
    wide[::2, ::3] = x
    want = SlidingDFT(7, [1, 2], 2).process(x)
    swapped = x.astype(x.dtype.newbyteorder())
    unaligned = np.frombuffer(b"x" + x.tobytes(), np.uint8)[1:].view(np.float64).reshape(x.shape)
    reverse = x[:, ::-1].copy()[:, ::-1]
    for form in (x.tolist(), wide[::2, ::3], np.asfortranarray(x), swapped, unaligned, reverse, x.T.copy().T):
        assert np.array_equal(SlidingDFT(7, [1, 2], 2).process(form), want)


@pytest.mark.parametrize("dtype", ["float64", "float32"])
def test_every_form_of_a_pushed_sample_is_accepted(dtype):
    forms = [(1.5, 2.0), [1.5, 2.0], np.array([1.5, 2.0]), np.array([1.5, 2.0], "f4"), (np.float32(1.5), 2)]
    for form in forms:
        dft = SlidingDFT(1, [0], 2, dtype)
        dft.push(form)
        assert dft.spectrum().ravel().tolist() == [1.5, 2.0]
    for form in (2.0, 2, np.float32(2), np.int8(2), np.array(2.0), [2.0], True + 1):
        dft = SlidingDFT(1, [0], 1, dtype)
        dft.push(form)
        assert dft.spectrum().tolist() == [2.0]


def test_one_push_takes_many_channels():
    dft = SlidingDFT(1, [0], 20)
    dft.push([float(i) for i in range(20)])
    assert dft.spectrum()[:, 0].tolist() == list(range(20))


def test_out_is_filled_and_returned_and_nothing_beyond_it_is_touched():
    rng = np.random.default_rng(0)
    for bins in range(1, 20):
        for channels in (1, 3):
            x = rng.standard_normal((channels, 70))
            whole = np.full((channels * 70 * bins + 2,), 7 + 7j)
            out = whole[1:-1].reshape(channels, 70, bins)
            dft = SlidingDFT(25, range(bins), channels)
            assert dft.process(x, out=out) is out
            assert np.array_equal(out, SlidingDFT(25, range(bins), channels).process(x))
            assert whole[0] == whole[-1] == 7 + 7j


def test_long_blocks_let_other_threads_run_and_refuse_them_the_object():
    dft = SlidingDFT(1000, range(100))
    x = np.zeros(400_000)
    out = np.empty((400_000 // 1000, 100), complex)
    refused, alive = [], [True]

    def knock() -> None:
        while alive[0]:
            try:
                dft.push(0.0)
            except RuntimeError as error:
                refused.append(str(error))
                return

    thread = threading.Thread(target=knock)
    thread.start()
    while not refused:
        try:
            dft.process(x, 1000, out=out) if dft.count % 1000 == 0 else dft.push(0.0)
        except RuntimeError as error:  # without the interpreter lock it can be this thread
            refused.append(str(error))
    alive[0] = False
    thread.join()
    assert "another thread" in refused[0]


def test_instruction_set_can_be_forced(monkeypatch):
    monkeypatch.delenv("LIVEBODE_INSTRUCTION_SET", raising=False)
    assert instruction_set() == instruction_sets()[-1]
    for name in instruction_sets():
        monkeypatch.setenv("LIVEBODE_INSTRUCTION_SET", name)
        assert instruction_set() == name == SlidingDFT(4, [1]).instruction_set
    monkeypatch.setenv("LIVEBODE_INSTRUCTION_SET", "sse9")
    with pytest.raises(ValueError, match="'sse9' is not one of best, baseline"):
        SlidingDFT(4, [1])


def test_modules_have_the_stable_abi_from_3_12():
    """One wheel then serves all later versions; 3.11 lacks what nanobind needs, a free-threaded Python has none."""
    files = {
        str(getattr(module, "__file__", "")) for name, module in sys.modules.items() if name.startswith("livebode.")
    }
    assert livebode.simulation.source
    compiled = [file for file in files if file.endswith((".so", ".pyd"))]
    assert len(compiled) == 2
    stable = sys.version_info >= (3, 12) and not sysconfig.get_config_var("Py_GIL_DISABLED")
    assert ["abi3" in file or file.endswith(".pyd") for file in compiled] == [stable] * 2
