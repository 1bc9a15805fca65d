"""Sizes of paper."""

from typing import Literal

Paper = Literal["a4", "letter"]
