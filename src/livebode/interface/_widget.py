"""A widget of a notebook that shows a run while it is being written."""

from __future__ import annotations

from html import escape
from os import PathLike
from pathlib import Path
from typing import Any

from livebode.core import LivebodeError, Responses, not_installed
from livebode.pictures import picture_html
from livebode.records import RunRecord

try:
    import anywidget
    import traitlets
except ImportError:
    raise not_installed("anywidget is not installed", package="anywidget", extra="notebook") from None

NEWEST_BYTES = 1 << 22
"""Size of the files of a run that are read at each look: some minutes, behind the newest response."""

_PAGE = """
function render({ model, el }) {
  const draw = () => { el.innerHTML = model.get("html"); };
  const look = () => {
    if (model.get("finished")) clearInterval(timer);
    else if (document.visibilityState === "visible") model.send({});
  };
  model.on("change:html", draw);
  draw();
  const timer = setInterval(look, 1000 * model.get("every_s"));
  return () => clearInterval(timer);
}
export default { render };
"""


class RunWidget(anywidget.AnyWidget):
    """The newest response of a run with its bound, in front of those before it; drawn again as the record grows.

    The notebook asks for it, so that nothing is read while nobody looks, and a cell that runs delays it.

    Parameters
    ----------
    path
        The run directory.
    every_s
        Seconds between two looks at the record.
    """

    _esm = _PAGE
    html = traitlets.Unicode().tag(sync=True)
    every_s = traitlets.Float().tag(sync=True)
    finished = traitlets.Bool(False).tag(sync=True)

    def __init__(self, path: str | PathLike[str], every_s: float = 1.0) -> None:
        self._path = Path(path)
        super().__init__(html="", every_s=every_s)
        self.on_msg(lambda *_: self.look())
        self.look()

    def look(self) -> None:
        """Draw what is recorded now; a run that cannot be read is reported in the picture's place."""
        try:
            record = RunRecord.open(self._path)
            parts = list(record.undamaged(record.batches(NEWEST_BYTES)))
            self.html = self._drawn(Responses.join(parts) if parts else record.responses()[:0])
            self.finished = record.ended
        except LivebodeError as error:
            self.html = f"<div>{escape(str(error))}</div>"

    def _drawn(self, responses: Responses) -> str:
        words: Any = f"Run {self._path.name}: {responses}"
        return f"<div>{escape(words)}</div>{picture_html(responses)}"
