"""The pages of this wing."""

from __future__ import annotations

from collections.abc import Mapping

WORKSPACES: Mapping[str, str] = {"start": "livebode_start.pages:StartPages"}
PAGES: Mapping[str, str] = {"start": "livebode_start.run_page:FinishButton"}
"""What it adds to the page of a run."""
