"""The style sheet of a report: light and dark on a screen, black on white on paper."""

from __future__ import annotations

from livebode.core import Tone
from livebode.pictures import DARK, LIGHT, Style, style_rules

_GREEN, _AMBER, _RED, _GREY = (
    ("#00734d", "#4cc79b"),
    ("#8a5a00", "#f0b44b"),
    ("#b3261e", "#ff8a80"),
    ("#5b6775", "#a3afbc"),
)
_TONES: dict[Tone, tuple[str, str]] = {
    "ok": _GREEN, "pass": _GREEN, "check": _AMBER, "undecided": _AMBER, "alarm": _RED, "differs": _RED, "fail": _RED,
    "open": _GREY,
}  # fmt: skip
TONE_COLOURS = {tone: light for tone, (light, _) in _TONES.items()}
"""On white paper; each has a contrast of 4.5 or more."""


def _colours(look: Style) -> str:
    """The colours of the page, named after those on white paper."""
    names = ("ink", "muted", "grid", "run", "paper")
    return " ".join(f"--c{getattr(LIGHT, name)[1:]}: {getattr(look, name)};" for name in names)


def _tones(dark: bool) -> str:
    return " ".join(f"--{tone}: {pair[dark]};" for tone, pair in _TONES.items())


STYLE_SHEET = (
    f":root {{ color-scheme: light dark; {_tones(False)} --shade: #f4f6f8; {_colours(LIGHT)} }}\n"
    "@media screen and (prefers-color-scheme: dark) { :root { "
    f"{_tones(True)} --shade: #1a222b; {_colours(DARK)} }} }}\n"
    + style_rules()
    + "".join(f".{tone} {{ color: var(--{tone}); }}\n" for tone in _TONES)
    + """
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 1.5rem 1.2rem 3rem; max-width: 62rem; color: var(--c1d2733); background: var(--cffffff);
  font: 16px/1.5 system-ui, "Segoe UI", "Noto Sans", "DejaVu Sans", sans-serif; }
header p.kind { margin: 0; color: var(--c5b6775); font-weight: 600; }
h1 { margin: 0 0 .8rem; font-size: 1.9rem; line-height: 1.2; overflow-wrap: anywhere; }
h2 { margin: 2.4rem 0 .7rem; padding-top: .5rem; border-top: 2px solid var(--ce3e7ec); font-size: 1.25rem; }
dl.facts { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(15rem, 45%), 1fr)); gap: .5rem 1.5rem;
  margin: 0; }
dl.facts div { min-width: 0; }
dt { color: var(--c5b6775); font-size: .82rem; }
dd { margin: 0; overflow-wrap: anywhere; }
ul.verdict { margin: .4rem 0 0; padding: 0; list-style: none; }
ul.verdict li { display: grid; grid-template-columns: 8.2rem 1fr; gap: .8rem; padding: .45rem 0;
  border-bottom: 1px solid var(--ce3e7ec); overflow-wrap: anywhere; }
.tone { font-weight: 700; }
table.answers { margin: 1.4rem 0 0; width: auto; min-width: min(100%, 34rem); }
table.answers th, table.answers td { padding: .3rem 1.4rem .3rem 0; border-bottom: 1px solid var(--ce3e7ec);
  vertical-align: baseline; }
table.answers th { font-weight: 400; color: var(--c5b6775); font-size: 1rem; }
table.answers td.value { font-size: 1.35rem; font-weight: 700; font-variant-numeric: tabular-nums; }
table.answers tr:first-child td.value { font-size: 2.1rem; line-height: 1.2; }
div.result { margin: 1.4rem 0 .6rem; padding: .7rem 1.1rem; border-left: .6rem solid currentColor; }
div.result p { margin: .2rem 0; }
p.word { font-size: 2.4rem; line-height: 1.15; font-weight: 700; }
p.why { font-size: 1.15rem; color: var(--c1d2733); }
img.logo { float: right; max-width: 40%; height: 4.2rem; margin: 0 0 .6rem 1.2rem; object-fit: contain; }
div.signatures { display: grid; grid-template-columns: repeat(auto-fit, minmax(14rem, 1fr)); gap: 2.6rem 3rem;
  margin-top: 4rem; }
div.signatures p { margin: 0; padding-top: .2rem; border-top: 1px solid var(--c1d2733); font-size: .82rem;
  color: var(--c5b6775); }
nav { margin: 1.2rem 0 0; font-size: .92rem; color: var(--c5b6775); }
nav a { color: var(--c0072b2); margin-right: 1rem; white-space: nowrap; display: inline-block; padding: .25rem 0; }
p { margin: .6rem 0; overflow-wrap: anywhere; }
figure { margin: 1rem 0; }
svg.figure { display: block; width: 100%; height: auto; }
figcaption, p.note { color: var(--c5b6775); font-size: .88rem; }
div.wide { overflow-x: auto; }
table { border-collapse: collapse; width: 100%; margin: .8rem 0 .3rem; font-size: .9rem; }
th { text-align: left; font-weight: 600; border-bottom: 1.5px solid var(--c5b6775); }
th, td { padding: .28rem .7rem .28rem 0; vertical-align: top; }
td { border-bottom: 1px solid var(--ce3e7ec); overflow-wrap: anywhere; }
thead td { border-bottom: 1.5px solid var(--c5b6775); }
td:first-child { min-width: 6.8rem; }
table.pairs td:first-child { width: 14rem; color: var(--c5b6775); }
.number { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap;
  padding: .28rem .5rem .28rem .2rem; }
thead .number { white-space: normal; }
.number + td:not(.number) { overflow-wrap: normal; }
pre { padding: .9rem 1rem; background: var(--shade); border-radius: 4px; white-space: pre-wrap; overflow-wrap: anywhere;
  font: .84rem/1.45 ui-monospace, "DejaVu Sans Mono", monospace; }
footer { margin-top: 3rem; color: var(--c5b6775); font-size: .85rem; overflow-wrap: anywhere; }
@media screen and (max-width: 34rem) { table.answers tr { display: grid; padding: .35rem 0;
  border-bottom: 1px solid var(--ce3e7ec); }
  table.answers th, table.answers td { padding: 0; border: 0; } table.answers td:empty { display: none; }
  table.answers tr:first-child td.value { font-size: 1.7rem; } }
@page { margin: 16mm 16mm 18mm;
  @bottom-right { content: counter(page) " / " counter(pages); font-size: 8pt; } }
@media print {
  body { padding: 0; max-width: none; font-size: 9.5pt; line-height: 1.4; }
  nav { display: none; }
  header, section.appendix { break-after: page; } section.appendix { break-before: page; break-after: auto; }
  header svg.figure { max-height: 76mm; }
  dl.facts { clear: both; grid-template-columns: repeat(3, 1fr); gap: .15rem 1rem; }
  table.answers td.value { font-size: 12pt; } table.answers tr:first-child td.value { font-size: 20pt; }
  p.word { font-size: 20pt; } p.why { font-size: 11pt; } div.signatures { margin-top: 14mm; }
  h1 { font-size: 18pt; } h2 { font-size: 12.5pt; margin-top: 16pt; break-after: avoid; }
  figure, ul.verdict li, dl.facts div, tr { break-inside: avoid; }
  table, pre { font-size: 8pt; } pre { background: none; border: 1px solid var(--ce3e7ec); }
  thead { display: table-header-group; }
  div.wide { overflow: visible; }
}
"""
)
