"""The paper's experiments and ours on the simulated axis: `python -m studies`, or `make studies`."""

from studies import budget, fig8_9, fig10, fig12, fig14

STUDIES = (fig8_9.STUDY, fig10.STUDY, fig12.STUDY, fig14.STUDY, budget.STUDY)
