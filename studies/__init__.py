"""The paper's experiments and ours on the simulated axis: `python -m studies`, or `make studies`."""

from studies import budget, fig8_9, fig10, fig12, float32, motion, nonlinearity

STUDIES = (fig8_9.STUDY, float32.STUDY, fig10.STUDY, fig12.STUDY, budget.STUDY, motion.STUDY, nonlinearity.STUDY)
