"""IEC 61131-3 Structured Text: valid names, numbers, comments and declarations."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable, Sequence
from math import isfinite

from livebode.core import UsageError, counted

NAME_LENGTH_MAX = 32
"""Length of names that every controller distinguishes."""

_KEYWORDS = """
abs abstract acos action adr and and_then any any_bit any_date any_derived any_elementary any_int any_magnitude any_num
any_real any_string array as asin at atan atan2 begin bit bitadr body bool by byte cal calc calcn case char class concat
configuration constant continue cos ctd ctu ctud date date_and_time delete dint div do dt dword else elsif end_action
end_case end_class end_configuration end_for end_function end_function_block end_if end_implementation end_interface
end_method end_namespace end_program end_property end_repeat end_resource end_step end_struct end_transition end_type
end_union end_var end_while eq exit exp expt extends f_edge f_trig false final find for from function function_block ge
get goto gt if implementation implements in indexof ini initial_step insert int interface internal interval jmp jmpc
jmpcn ld ldate ldate_and_time ldn ldt le left len limit lint ln log lower_bound lreal lt ltime ltime_of_day ltod lword
max method mid min mod move mul mux namespace ne non_retain not null of on or or_else override overlap package
params parallel persistent pointer priority private program property protected public pvoid r_edge r_trig read_only
read_write real ref ref_to reference repeat replace resource ret retain retc retcn return right rol ror rs sel
semaphore set shl shr sin single sint sizeof sqrt sr st step string struct stn sub super tan task
then this time time_of_day to tod tof ton tp transition true trunc type udint uint ulint union until usint using uxint
var var_access var_config var_external var_global var_in_out var_inst var_input var_output var_stat var_temp
varinfo wchar while with word wstring xint xor xsizeof xword
__catch __endtry __finally __try __new __delete __queryinterface __querypointer __isvalidref
"""
KEYWORDS = frozenset(_KEYWORDS.split())
"""Words of IEC 61131-3 and of TwinCAT 3 and CODESYS, types, operators, standard functions and blocks, lower case."""

_NAME = re.compile(r"(?a:_?[A-Za-z][A-Za-z0-9]*(?:_[A-Za-z0-9]+)*)")
_CONVERSION = re.compile(r"(?:[a-z]+_)?to_[a-z]+")
SMALLEST = sys.float_info.min
"""Magnitude below which an LREAL loses digits, or is zero on some controllers."""
BYTES_MAX = 8 << 20
"""Most memory of one block or ring: limit of what livebode reads from a PLC, and more than most PLCs have free."""
Declared = tuple[str, str, str]
"""A variable, or several with commas between: name, type with its initial value, comment."""


def as_name(text: str, taken: Iterable[str] = ()) -> str:
    """The nearest valid name to `text` in Structured Text that is not in `taken`.

    >>> as_name("2nd motor [rad/s]"), as_name("limit"), as_name("u", taken=["U"])
    ('x2nd_motor_rad_s', 'limit_1', 'u_1')
    """
    name = re.sub(r"_+", "_", re.sub(r"[^A-Za-z0-9]", "_", text)).strip("_") or "x"
    name = f"x{name}" if name[0].isdigit() else name
    names = {other.lower() for other in taken}
    number, free = 0, name[:NAME_LENGTH_MAX].rstrip("_")
    while _reserved(free) or free.lower() in names:
        number += 1
        free = f"{name[: NAME_LENGTH_MAX - 1 - len(str(number))].rstrip('_')}_{number}"
    return free


def check_name(name: str, element: str) -> None:
    """Check that `name` is valid in Structured Text; `element` describes in the message whose name it is.

    Raises
    ------
    UsageError
        For a keyword, a character that is not an ASCII letter, digit or underscore, a digit in front, two underscores
        in a row or one at the end, or more than 32 characters; with the nearest name that is allowed.
    """
    if problem := _problem(name):
        nearest = as_name(name)
        raise UsageError(
            "invalid-name",
            f"{element} {name!r} {problem} in Structured Text",
            f"take {nearest}",
            value=name,
            element=element,
            nearest=nearest,
        )


def check_names(names: Sequence[str], element: str, taken: Iterable[str] = ()) -> None:
    """Check names of one scope, together with `taken`: each is valid and none is twice; case is ignored."""
    own = {name.lower() for name in taken}
    before: dict[str, str] = {}
    for name in names:
        check_name(name, element)
        low = name.lower()
        if low in own or low in before:
            other = f"the same as {before[low]!r}" if low in before else "used by the generated text"
            nearest = as_name(name, [*own, *names])
            raise UsageError(
                "duplicate",
                f"{element} {name!r} is {other} in Structured Text, which ignores case",
                f"take {nearest}",
                value=name,
                element=element,
                nearest=nearest,
            )
        before[low] = name


def _reserved(name: str) -> bool:
    return name.lower() in KEYWORDS or _CONVERSION.fullmatch(name.lower()) is not None


def _problem(name: str) -> str | None:
    if _reserved(name):
        return "is a keyword"
    if not name.isascii() or not name.replace("_", "a").isalnum():
        return "has a character that is not allowed"
    if name[0].isdigit():
        return "begins with a digit, which is not allowed"
    if _NAME.fullmatch(name) is None:
        return "has two underscores in a row, one at its end, or a digit after a leading one, which is not allowed"
    if len(name) > NAME_LENGTH_MAX:
        return f"has {len(name)} characters, more than {NAME_LENGTH_MAX},"
    return None


def real(value: float) -> str:
    """The number as an LREAL literal, whose digits give the same bits.

    >>> real(0.1), real(1e-17), real(-3)
    ('0.1', '1.0E-17', '-3.0')
    """
    digits, _, exponent = repr(float(value)).partition("e")
    return (digits if "." in digits else f"{digits}.0") + (f"E{int(exponent)}" if exponent else "")


def comment(text: str) -> str:
    """Comment lines (`//`) in ASCII, because not every programming system accepts other letters; empty for no text."""
    lines = text.encode("ascii", "replace").decode().splitlines()
    return "".join(f"// {''.join(c if c.isprintable() else ' ' for c in line)}".rstrip() + "\n" for line in lines)


def section(kind: str, declared: Iterable[Declared]) -> str:
    """Declarations from `VAR_…` to `END_VAR`, aligned."""
    rows = list(declared)
    width = min(max(len(name) for name, _, _ in rows), 14)
    types = max(len(of) for _, of, _ in rows) + 1
    lines = [f"    {name:<{width}} : {f'{of};':<{types}}  // {comment}".rstrip(" /") for name, of, comment in rows]
    return "\n".join([kind, *lines, "END_VAR", ""])


def array(*lengths: int, of: str = "LREAL") -> str:
    """The type of an array that counts from 0.

    >>> array(2, 7)
    'ARRAY [0..1, 0..6] OF LREAL'
    """
    return f"ARRAY [{', '.join(f'0..{length - 1}' for length in lengths)}] OF {of}"


def check_rate(rate_hz: float) -> None:
    """UsageError for an invalid rate of a task."""
    if not (isfinite(rate_hz) and rate_hz > 0):
        raise UsageError(
            "out-of-range",
            f"{rate_hz=} is not above 0",
            "give the cycles of the task per second",
            argument="rate_hz",
            value=rate_hz,
        )


def check_bytes(fixed: int, each: int, count: int, element: str) -> None:
    """UsageError if `fixed` + `each`·`count` bytes are more than a PLC has; `element` describes the counted object."""
    needed = fixed + each * count
    if needed > BYTES_MAX:
        most = (BYTES_MAX - fixed) // each
        raise UsageError(
            "too-large",
            f"{element} of {counted(count, 'sample')} takes {needed} bytes of the PLC, more than {BYTES_MAX}",
            f"use at most {counted(most, 'sample')}",
            samples=count,
            samples_max=most,
            size_bytes=needed,
            limit_bytes=BYTES_MAX,
        )
