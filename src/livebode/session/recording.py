"""One run on a recording."""

from __future__ import annotations

import time

from livebode.nouns import Event
from livebode.session.axis import Axis
from livebode.session.destination import Destination
from livebode.session.following import Outcome, Tracking
from livebode.session.orders import Orders
from livebode.session.pipeline import Pipeline
from livebode.session.plan import make_follower, roles_in_doubt
from livebode.session.tracking import whole
from livebode.sources import open_log


def run(axis: Axis, to: Destination, orders: Orders | None = None) -> Outcome:
    """Track a recording and leave a run directory; in segments where the axis has a [record].

    Raises
    ------
    InputError
        For anything in the recording or the configuration that cannot be; nothing is left in the directory then, or in
        segments all that was recorded so far.
    StoppedError
        Where `orders` end it; what is left is the same.
    """
    started = time.perf_counter()
    assert axis.source.log is not None
    log = open_log(axis.source.log, rate_hz=axis.source.rate_hz, time=axis.source.time)
    pipeline = Pipeline.of(axis, make_follower(axis, log))
    orders = orders or Orders()
    doubts = roles_in_doubt(axis, log, pipeline.follower.settings)
    for message in doubts:
        orders.say("roles-doubtful", message)
    found = {"format": log.format, "rate_from": log.rate_origin}
    about = {"configuration": axis.model_dump(mode="json", exclude={"serve"}), "found": found}
    outcome = whole(Tracking(log, pipeline, to, about=about, kept=axis.record, started=started, orders=orders))
    for message in doubts:
        to.tell(Event("roles-doubtful", 0, 0.0, message))
    return outcome
