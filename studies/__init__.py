"""The paper's experiments and ours on the simulated axis: `python -m studies`, or `make studies`."""

from studies import fig8_9, fig10

STUDIES = (fig8_9.STUDY, fig10.STUDY)
