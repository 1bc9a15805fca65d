"""Short form of `python -m studies.crest`."""

import pytest

from studies.crest import LONG, row


@pytest.mark.parametrize("count", LONG)
def test_low_crest_phases_are_near_the_best_that_is_known(count):
    """Within 1.05 of the lowest crest factor that the long search found (python -m studies.crest --long)."""
    text = row(count, long=False)
    assert text.endswith("met |"), text
