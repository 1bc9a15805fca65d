"""Files that TwinCAT 3 can add to a project directly: .TcPOU and .TcDUT."""

from __future__ import annotations

import re
from uuid import NAMESPACE_URL, uuid5

_POU = re.compile(
    r"(?P<declaration>.*?^(?:FUNCTION_BLOCK|PROGRAM) (?P<name>\w+)$.*^END_VAR\n)"
    r"(?P<body>.*)^END_(?:FUNCTION_BLOCK|PROGRAM)\n",
    re.DOTALL | re.MULTILINE,
)
_TYPE = re.compile(r"^TYPE (?P<name>\w+) :", re.MULTILINE)


def twincat(text: str) -> tuple[str, str]:
    """Name and content of the TwinCAT file for a generated text.

    Parameters
    ----------
    text
        One function block, program or structure, in the form of this package.

    Examples
    --------
    >>> from livebode_drives.structured_text.project import ring_type
    >>> twincat(ring_type(2, rate_hz=4000))[0]
    'ST_LivebodeRing.TcDUT'
    """
    if pou := _POU.fullmatch(text):
        name, ending = pou["name"], "TcPOU"
        body = f"    <Implementation>\n      <ST>{_literal(pou['body'].lstrip())}</ST>\n    </Implementation>\n"
        inner = f"    <Declaration>{_literal(pou['declaration'])}</Declaration>\n{body}"
        tag = f'POU Name="{name}" Id="{_identity(name)}" SpecialFunc="None"'
    else:
        match = _TYPE.search(text)
        assert match is not None
        name, ending = match["name"], "TcDUT"
        inner = f"    <Declaration>{_literal(text)}</Declaration>\n"
        tag = f'DUT Name="{name}" Id="{_identity(name)}"'
    return f"{name}.{ending}", (
        '<?xml version="1.0" encoding="utf-8"?>\n<TcPlcObject Version="1.1.0.1" ProductVersion="3.1.4024.0">\n'
        f"  <{tag}>\n{inner}  </{tag.split()[0]}>\n</TcPlcObject>\n"
    )


def _literal(text: str) -> str:
    return f"<![CDATA[{text.replace(']]>', ']]]]><![CDATA[>')}]]>"


def _identity(name: str) -> str:
    """Equal for equal names: a file that is generated again is the same object for TwinCAT."""
    return f"{{{uuid5(NAMESPACE_URL, f'livebode/{name}')}}}"
