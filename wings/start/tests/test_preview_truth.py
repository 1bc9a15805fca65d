"""What is drawn of a signal, compared with NumPy on all samples."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.sources import open_log
from livebode_start import preview
from livebode_start.preview import SignalOverview


@settings(max_examples=40, deadline=None)
@given(data=st.data(), samples=st.integers(20, 5000), seed=st.integers(0, 9), pieces=st.sampled_from([64, 1 << 16]))
def test_extremes_are_those_of_all_samples(
    tmp_path_factory: object, data: st.DataObject, samples: int, seed: int, pieces: int
) -> None:
    folder = tmp_path_factory.mktemp("log")  # type: ignore[attr-defined]
    rng = np.random.default_rng(seed)
    values = rng.standard_normal(samples)
    values[rng.integers(samples, size=samples // 50)] = np.nan
    path = Path(folder) / "log.csv"
    rows = "".join(f"{k / 1000:.3f},{value:.17g}\n" for k, value in enumerate(values))
    path.write_text("t [s],y\n" + rows.replace("nan", ""))
    begin = data.draw(st.integers(0, samples - 2))
    end = data.draw(st.integers(begin + 1, samples - 1))
    points = data.draw(st.integers(1, 300))
    before, preview.OVERVIEW_PIECES = preview.OVERVIEW_PIECES, pieces
    try:
        shown = SignalOverview.read(open_log(path), ["y"], samples).plain("y", begin / 1000, end / 1000, points)
    finally:
        preview.OVERVIEW_PIECES = before
    first, size = round(shown["from_s"] * 1000), round(shown["step_s"] * 1000)
    assert first <= begin
    assert first + size * len(shown["low"]) > end
    assert len(shown["low"]) <= points + 2 or size == 1
    for number, low in enumerate(shown["low"]):
        piece = values[first + number * size : min(first + (number + 1) * size, samples)]
        piece = piece[np.isfinite(piece)]
        high = low if shown["high"] is None else shown["high"][number]
        if not piece.size:
            assert low is high is None
            continue
        # The last piece of a span may end with the span.
        if number < len(shown["low"]) - 1:
            np.testing.assert_allclose([low, high], [piece.min(), piece.max()], rtol=1e-5)
        else:
            assert piece.min() * (1 - 1e-5 * np.sign(piece.min())) <= low <= high
