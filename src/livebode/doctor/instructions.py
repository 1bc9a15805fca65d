"""Which instruction set the kernel uses."""

from __future__ import annotations

import platform

from livebode.doctor.check import Check
from livebode.kernel import instruction_set, instruction_sets

NAME = "instruction set"


def check_instruction_set() -> Check:
    """The one that is used, of those that this machine has."""
    available = list(instruction_sets())
    facts = {"available": available, "machine": platform.machine()}
    try:
        used = instruction_set()
    except ValueError as error:
        return Check(NAME, "failed", str(error), f"unset it, or take one of {', '.join(available)}", facts)
    message = f"the kernel uses {used}; this {platform.machine()} computer has {', '.join(available)}"
    if used != available[-1]:
        remedy = "unset LIVEBODE_INSTRUCTION_SET; the results are the same, and faster"
        return Check(NAME, "warning", message, remedy, facts | {"used": used})
    return Check(NAME, "ok", message, facts=facts | {"used": used})
