"""The language in which report and dashboard are read: catalogues of sentences, numbers and dates.

The English sentences are the keys. Translators edit `catalogues/*.po`; ``make catalogues`` writes the JSON
files that Python and the page read at run time. Terminal, log, record and JSON output are always English.
"""

from livebode.language.catalogue import ENGLISH, Catalogue, available, catalogue
from livebode.language.negotiation import for_page, negotiated
from livebode.language.recognition import recognised
from livebode.language.spoken import date, listed, marked, number, numerals, spoken, tr, trn, used

__all__ = [
    "ENGLISH",
    "Catalogue",
    "available",
    "catalogue",
    "date",
    "for_page",
    "listed",
    "marked",
    "negotiated",
    "number",
    "numerals",
    "recognised",
    "spoken",
    "tr",
    "trn",
    "used",
]
