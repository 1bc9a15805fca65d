"""The command line."""

from livebode.cli.app import app, main

__all__ = ["app", "main"]
