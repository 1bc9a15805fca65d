"""The pages of this wing."""

from __future__ import annotations

from collections.abc import Mapping

WORKSPACES: Mapping[str, str] = {"start": "livebode_start.pages:StartPages"}
