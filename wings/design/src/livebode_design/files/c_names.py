"""Names that are valid in C and MATLAB."""

from __future__ import annotations

import re
from typing import Literal

from livebode.core import DesignError

LETTERS_MAX = {"C": 63, "MATLAB": 31}  # significant in C99; in a struct's name of a MATLAB v5 file
_C = """
auto break case char const continue default do double else enum extern float for goto if inline int long register
restrict return short signed sizeof static struct switch typedef union unsigned void volatile while alignas alignof
bool constexpr false nullptr static_assert thread_local true typeof typeof_unqual asm fortran main
and and_eq bitand bitor catch class compl const_cast delete dynamic_cast explicit export friend mutable namespace new
not not_eq operator or or_eq private protected public reinterpret_cast static_cast template this throw try typeid
typename using virtual wchar_t xor xor_eq
NULL EOF INFINITY NAN I assert errno stdin stdout stderr offsetof va_arg va_start va_end
"""
_MATLAB = """
break case catch classdef continue else elseif end for function global if otherwise parfor persistent return spmd
switch try while
"""
KEYWORDS = {"C": frozenset(_C.split()), "MATLAB": frozenset(_MATLAB.split())}


def identifier(name: str, language: Literal["C", "MATLAB"] = "C") -> str:
    """The name, if it is a valid variable name; for C, also in a header that C++ includes.

    Raises
    ------
    DesignError
        If it is not valid; the message has the nearest valid one.

    >>> identifier("w_1")
    'w_1'
    >>> identifier("double")
    Traceback (most recent call last):
    ...
    livebode.DesignError: the name 'double' is a keyword or macro of C or C++; ...
    """
    most = LETTERS_MAX[language]
    if name in KEYWORDS[language]:
        whose = "keyword or macro of C or C++" if language == "C" else f"keyword of {language}"
        why, nearest = f"is a {whose}", f"{name}_w"
    elif re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name) and "__" not in name and len(name) <= most:
        return name
    else:
        why = f"is not valid in {language} (letters, digits and single underscores, a letter first, at most {most})"
        nearest = _nearest(name, most, KEYWORDS[language])
    facts = {"argument": "name", "name": name, "language": language, "nearest": nearest}
    raise DesignError("name-forbidden", f"the name {name!r} {why}", f"take for example {nearest!r}", **facts)


def _nearest(name: str, most: int, keywords: frozenset[str]) -> str:
    plain = re.sub(r"_+", "_", re.sub(r"[^A-Za-z0-9_]", "_", name)).strip("_")[: most - 2].rstrip("_")
    if not plain:
        return "excitation"
    if not plain[0].isalpha():
        plain = f"w_{plain}"
    return plain if plain not in keywords else f"{plain}_w"
