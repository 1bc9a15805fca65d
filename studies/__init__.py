"""The experiments of the paper and of livebode on the simulated axis: `python -m studies`, or `make studies`."""

from studies import budget, fig8_9, fig10, fig12, fig13, fig14, fits, float32, motion, nonlinearity

STUDIES = (
    *(fig8_9.STUDY, float32.STUDY, fig10.STUDY, fig12.STUDY, fig13.STUDY, fig14.STUDY, fits.STUDY, budget.STUDY),
    *(motion.STUDY, nonlinearity.STUDY),
)
