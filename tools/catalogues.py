"""The catalogues of report and dashboard: extracts the English sentences, and writes what is read at run time.

``make catalogues`` updates `src/livebode/language/catalogues/*.po` from the source of the hull and the wings, and
writes the JSON files from them.
"""

from __future__ import annotations

import gettext
import json
import re
import sys
from collections.abc import Iterable
from functools import cache
from html.parser import HTMLParser
from io import BytesIO
from pathlib import Path
from typing import Any

from babel.core import Locale
from babel.messages.catalog import Catalog, Message
from babel.messages.extract import extract
from babel.messages.pofile import read_po, write_po

from livebode.analysis import MARGIN_NAMES as MARGINS
from livebode.dashboard.quantities import QUANTITIES
from livebode.estimation.verdicts import KINDS as DOUBTS
from livebode.fitting import model_named
from livebode.fitting.extended import COUPLING, LAG, MODE, RESIDUAL, ExtendedModel
from livebode.fitting.models import MODELS
from livebode.language import QUANTITY_NAMES
from livebode.monitoring import ALARMS, RETURNS, UNMONITORED
from livebode.monitoring.sensitivity import DIRECTIONS
from livebode.runtime.run_counts import CAUSES
from livebode_start.tasks import texts as texts_of_tasks

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / "src/livebode/language/catalogues"
_KEYWORDS = {"tr": None, "Message": None, "trn": (1, 2)}
_CALL = re.compile(r"\b(?:trn?|Message)\(")
_EVENT = re.compile(r"\b(?:Event|report|_report_to_axes|_tell)\(\s*\"([a-z]+(?:-[a-z]+)*)\"")
_SHOWN = ("title", "aria-label", "placeholder", "alt")
_NO_WORDS = re.compile(r"[\W\d_]*|livebode", re.ASCII)
VALUES = (
    "margins", "missing", "model", "no fit", "none needed", "ok", "parameters", "plant input", "refused", "suggested",
    "tables", "the sender", "velocity reference",
)  # fmt: skip
"""Values of configurations and records that a report or a page shows."""
Key = str | tuple[str, str]


def sources(pattern: str) -> list[Path]:
    """Files of the hull and the wings."""
    return [
        path for folder in (ROOT / "src", *sorted(ROOT.glob("wings/*/src"))) for path in sorted(folder.rglob(pattern))
    ]


@cache
def extracted() -> dict[Key, set[str]]:
    """Every sentence and name of the source, with the files that have it."""
    found: dict[Key, set[str]] = {}

    def add(keys: Iterable[Key], where: str) -> None:
        for key in keys:
            found[key] = found.get(key, set()) | {where}

    for path in sources("*.py"):
        add(_called("python", path), str(path.relative_to(ROOT)))
        add(_EVENT.findall(path.read_text("utf-8")), str(path.relative_to(ROOT)))
    for path in sources("static/*.js"):
        add(_called("javascript", path), str(path.relative_to(ROOT)))
    for path in sources("static/*.html"):
        add(html_texts(path.read_text("utf-8")), str(path.relative_to(ROOT)))
    add(_names(), "tools/catalogues.py")
    return found


def _names() -> set[str]:
    """What is data: names of quantities, parameters, margins and alarms; the help of what the tasks ask for."""
    found = {*QUANTITIES, *QUANTITY_NAMES, *DIRECTIONS, *ALARMS, *RETURNS, *UNMONITORED, *CAUSES, *DOUBTS, *VALUES}
    found |= texts_of_tasks()
    for model in map(model_named, MODELS):
        extended = ExtendedModel(model, (LAG, RESIDUAL, MODE, COUPLING), 100.0)
        found |= {name.replace("_", " ") for name in (*extended.names, *model.derived_names)}
    return found | {name.replace("_", " ") for name in MARGINS}


def _called(kind: str, path: Path) -> list[Key]:
    if not _CALL.search(path.read_text("utf-8")):
        return []
    with path.open("rb") as file:
        rows = extract(kind, file, _KEYWORDS, options={"encoding": "utf-8"})
        return [message if isinstance(message, str) else (message[0], message[1]) for _, message, _, _ in rows]


def html_texts(page: str) -> list[str]:
    """The texts and titles of a page that a person sees."""
    parser = _Texts()
    parser.feed(page)
    return parser.found


class _Texts(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []

    def handle_data(self, data: str) -> None:
        self._take(data)

    def handle_starttag(self, _tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for name, value in attrs:
            if name in _SHOWN and value:
                self._take(value)

    def _take(self, text: str) -> None:
        text = " ".join(text.split())
        if not _NO_WORDS.fullmatch(text) and text not in self.found:
            self.found.append(text)


def catalogues() -> dict[str, Catalog]:
    """The catalogues by the code of their language, as translators left them."""
    found = {}
    for path in sorted(FOLDER.glob("*.po")):
        with path.open("rb") as file:
            found[path.stem] = read_po(file)
    return found


def updated(old: Catalog) -> Catalog:
    """The catalogue with the sentences of the source, and its translations of them."""
    new = Catalog(locale=old.locale_identifier, fuzzy=False, charset="utf-8")
    for key, files in extracted().items():
        before = old.get(key if isinstance(key, str) else key[0])
        string: Any = before.string if before is not None and isinstance(before.id, str) == isinstance(key, str) else ""
        new.add(key, string or None, locations=[(name, None) for name in sorted(files)])
    return new


def po_text(of: Catalog) -> bytes:
    """The file for translators, sorted by the English sentence."""
    file = BytesIO()
    write_po(file, of, width=110, omit_header=True, sort_output=True, include_lineno=False)
    header = (
        f'msgid ""\nmsgstr ""\n"Language: {of.locale_identifier}\\n"\n"Content-Type: text/plain; charset=utf-8\\n"\n'
        f'"Plural-Forms: {of.plural_forms}\\n"\n\n'
    )
    return header.encode() + file.getvalue()


def translated(message: Message) -> bool:
    """Whether it has all its forms."""
    forms = (message.string,) if isinstance(message.string, str) else message.string
    return bool(forms) and all(forms)


def own_name(locale: Locale) -> str:
    """Name of the language in itself, with its script where there are several."""
    names = locale.languages
    return str(names.get(f"{locale.language}_{locale.script}") or names[locale.language])


def date_format(locale: Locale) -> str:
    """Its usual numeric date with time and zone, for `strftime`; ISO 8601 where the usual one has names."""
    usual = (str(locale.date_formats[size].pattern) for size in ("medium", "short"))
    pattern = next((pattern for pattern in usual if "MMM" not in pattern), "y-MM-dd")
    for letters, directive in (("d+", "%d"), ("M+", "%m"), ("y+", "%Y")):
        pattern = re.sub(letters, directive, pattern)
    return f"{pattern} %H:%M:%S %Z"


def run_time(of: Catalog) -> dict[str, Any]:
    """What Python and page read."""
    locale = of.locale
    assert locale is not None
    form, symbols = gettext.c2py(of.plural_expr), locale.number_symbols["latn"]
    messages = {}
    for message in of:
        if not message.id or not translated(message):
            continue
        if isinstance(message.id, str):
            messages[message.id] = message.string
        else:
            messages[message.id[0]] = list(message.string)
    return {
        "code": of.locale_identifier.replace("_", "-"), "name": own_name(locale), "decimal": symbols["decimal"],
        "group": symbols["group"], "date": date_format(locale),
        "plural": "".join(str(form(n)) for n in range(200)), "messages": messages,
    }  # fmt: skip


def json_text(of: Catalog) -> str:
    return json.dumps(run_time(of), ensure_ascii=False, indent=0, sort_keys=True) + "\n"


def main() -> None:
    missing = 0
    for code, old in catalogues().items():
        new = updated(old)
        (FOLDER / f"{code}.po").write_bytes(po_text(new))
        (FOLDER / f"{code}.json").write_text(json_text(new), "utf-8")
        lacking = [message.id for message in new if message.id and not translated(message)]
        missing += len(lacking)
        print(f"{code}: {len(new)} sentences, {len(lacking)} without translation")
        for key in lacking[:20]:
            print(f"  {key}")
    sys.exit(missing > 0)


if __name__ == "__main__":
    main()
