"""Runs the subset of Structured Text that livebode generates, from blark's parse tree: what is parsed is what runs."""

from tools.structured_text.machine import Instance, Machine, parse
from tools.structured_text.types import RefusedError

__all__ = ["Instance", "Machine", "RefusedError", "parse"]
