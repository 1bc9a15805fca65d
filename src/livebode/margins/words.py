"""Names of the margins for people."""

from __future__ import annotations

WORDS = {
    "gain_margin": "gain may rise by",
    "gain_reduction": "gain may fall by",
    "phase_margin": "phase margin",
    "delay_margin": "delay margin",
    "peak_sensitivity": "peak sensitivity Ms",
    "bandwidth": "bandwidth",
}
