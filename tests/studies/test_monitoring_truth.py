"""Short form of `python -m studies.monitoring`."""

from livebode.simulation import LoadChange, TensionLoss
from studies.monitoring import trial
from tests.support.monitored import machine


def test_losses_of_half_a_percent_and_loads_of_two_are_detected_in_one_stroke() -> None:
    """As `python -m studies.monitoring` does it, a few strokes of each."""
    for i in range(4):
        assert trial(machine(), 100_000 + i, lambda _: TensionLoss(loss=0.005)).found("stiffness")
        assert trial(machine(), 500_000 + i, lambda _: LoadChange(load_kg=0.134)).found("load")
