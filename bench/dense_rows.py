"""A row after every sample by livebode, in both phases, and by Numba, side by side."""

from collections.abc import Callable

from bench import numba_versions
from bench.work import Array, side_by_side
from livebode.kernel import SlidingDFT


def nanoseconds(
    x: Array, window: int, bins: list[int], out: Array, seconds: float, **more: Callable[[], object]
) -> dict[str, float]:
    """Of a row, by "window", "fixed", "numba" (the faster of two) and `more`; the rows are written to `out`."""
    tasks: dict[str, Callable[[], object]] = {
        "numba complex": numba_versions.by_numba_complex(x, window, bins, 1),
        "numba planar": numba_versions.by_numba_planar(x, window, bins, 1),
        **more,
    }
    for phase in ("window", "fixed"):
        dft = SlidingDFT(window, bins)
        tasks[phase] = lambda dft=dft, phase=phase: dft.process(x[: len(out)], 1, out, phase)  # type: ignore[misc]
    best = {name: 1e9 * time / len(out) for name, time in side_by_side(tasks, seconds).items()}
    return {"numba": min(best.pop("numba complex"), best.pop("numba planar")), **best}
