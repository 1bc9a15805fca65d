"""The result of the monitoring of a run as a sentence."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from livebode.core import counted


def result_sentence(summary: Mapping[str, Any], together: str = "") -> str:
    """Of judged time and changes as in run.json; `together` has the amounts of the active ones."""
    judged = f"{summary['judged_s']:.1f} s of the run judged"
    if not summary["judged_s"]:
        return "Nothing of the run could be judged: the baseline does not cover what the machine did."
    if not summary["changes"]:
        return f"No change against the baseline ({judged})."
    alarms = f"{counted(summary['changes'], 'change')} against the baseline"
    standing = f"{len(summary['standing']) or 'none'} of them active at the end ({judged})"
    return f"{alarms}, {standing}{together}."
