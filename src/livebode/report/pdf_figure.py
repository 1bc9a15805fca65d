"""A Matplotlib figure as vectors and text of a PDF page.

ReportLab accepts neither SVG nor pages of another PDF; svglib, which reads SVG, does not support clip paths and would
be another dependency; an image of 200 dpi is coarse and its text cannot be searched. A Matplotlib backend only has to
draw a path, an image and a text. This one draws on ReportLab's canvas, so lines are sharp and text is searchable.
"""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.backend_bases import RendererBase
from matplotlib.backends.backend_mixed import MixedModeRenderer
from reportlab.lib.utils import ImageReader
from reportlab.pdfbase import pdfmetrics

from livebode.report.pdf_fonts import BOLD, PLAIN, runs, wide_font
from livebode.report.style import LIGHT, drawing, quiet_about_letters, wide_letters

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from matplotlib.path import Path as Curve
    from reportlab.pdfgen.canvas import Canvas

_LACKING = 0.4  # of the size, by which Matplotlib measures a wide letter too narrow
_RASTER_DPI = 220  # of maps, whose cells are pixels in any case
_CAPS = {"butt": 0, "round": 1, "projecting": 2}
_JOINS = {"miter": 0, "round": 1, "bevel": 2}
_MOVE, _LINE, _CURVE3, _CURVE4, _CLOSE = 1, 2, 3, 4, 79


def draw_on(canvas: Canvas, figure: Figure) -> None:
    """Draw the figure at the origin of the canvas, one point of it for one point of the page."""
    width_in, height_in = figure.get_size_inches()
    before = figure.dpi
    figure.dpi = 72
    vector = _OnCanvas(canvas, 72 * width_in, 72 * height_in)
    try:
        with drawing(LIGHT), quiet_about_letters():
            mixed: Any = MixedModeRenderer(figure, width_in, height_in, _RASTER_DPI, vector)  # type: ignore[no-untyped-call]
            figure.draw(mixed)
    finally:
        figure.dpi = before


class _OnCanvas(RendererBase):
    """A Matplotlib renderer on a page, in points from the lower left corner."""

    def __init__(self, canvas: Canvas, width: float, height: float) -> None:
        super().__init__()
        self._canvas, self.width, self.height = canvas, width, height

    def get_canvas_width_height(self) -> tuple[float, float]:
        return self.width, self.height

    def get_image_magnification(self) -> float:
        return _RASTER_DPI / 72

    def flipy(self) -> bool:
        return False

    def draw_path(self, gc: Any, path: Curve, transform: Any, rgbFace: Any = None) -> None:
        # Lines are clipped to the page: PDF readers fail on coordinates in the millions.
        page = None if rgbFace is not None else (0.0, 0.0, self.width, self.height)
        simplify = False if rgbFace is not None else None
        self._paint(gc, rgbFace, path.iter_segments(transform, clip=page, simplify=simplify))

    def draw_markers(
        self, gc: Any, marker_path: Curve, marker_trans: Any, path: Curve, trans: Any, rgbFace: Any = None
    ) -> None:
        """Draw all markers as one shape: thousands of single shapes would take seconds."""
        one = [(np.asarray(points), code) for points, code in marker_path.iter_segments(marker_trans, simplify=False)]
        at = [points[-2:] for points, _ in path.iter_segments(trans, simplify=False)]
        inside = [p for p in at if -9 < p[0] < self.width + 9 and -9 < p[1] < self.height + 9]
        self._paint(gc, rgbFace, ((points + np.resize(p, points.size), code) for p in inside for points, code in one))

    def _paint(self, gc: Any, face: Any, segments: Any) -> None:
        canvas = self._canvas
        fill = face is not None and _alpha(gc, face) > 0
        stroke = gc.get_linewidth() > 0 and (len(gc.get_rgb()) < 4 or gc.get_rgb()[3] > 0)
        if not (fill or stroke):
            return
        canvas.saveState()
        self._clip(gc)
        if fill:
            canvas.setFillColorRGB(*(float(c) for c in face[:3]), alpha=_alpha(gc, face))
        if stroke:
            _set_stroke(canvas, gc)
        canvas.drawPath(_shape(canvas, segments), stroke=int(stroke), fill=int(fill), fillMode=1)
        canvas.restoreState()

    def draw_image(self, gc: Any, x: float, y: float, im: Any, transform: Any = None) -> None:
        from PIL import Image

        if transform is not None:
            raise NotImplementedError("images that are turned are not drawn")
        height, width = im.shape[:2]
        file = io.BytesIO()
        Image.fromarray(np.ascontiguousarray(im[::-1])).save(file, "PNG")
        self._canvas.saveState()
        self._clip(gc)
        size = (width * 72 / _RASTER_DPI, height * 72 / _RASTER_DPI)
        self._canvas.drawImage(ImageReader(file), x, y, *size, mask="auto")
        self._canvas.restoreState()

    def draw_text(
        self, gc: Any, x: float, y: float, s: str, prop: Any, angle: float, *_args: Any, **_options: Any
    ) -> None:
        canvas = self._canvas
        canvas.saveState()
        self._clip(gc)
        canvas.setFillColorRGB(*(float(c) for c in gc.get_rgb()[:3]), alpha=_alpha(gc, gc.get_rgb()))
        canvas.translate(x, y)
        canvas.rotate(angle)
        bold = prop.get_weight() in ("bold", "semibold", 600, 700)
        draw_string(canvas, 0, s, BOLD if bold else PLAIN, prop.get_size_in_points())
        canvas.restoreState()

    def get_text_width_height_descent(self, s: str, prop: Any, ismath: Any) -> tuple[float, float, float]:
        width, height, descent = super().get_text_width_height_descent(s, prop, ismath)
        return width + _LACKING * wide_letters(s) * prop.get_size_in_points(), height, descent

    def _clip(self, gc: Any) -> None:
        canvas = self._canvas
        if (box := gc.get_clip_rectangle()) is not None:
            shape = canvas.beginPath()
            shape.rect(*(float(v) for v in box.bounds))
            canvas.clipPath(shape, stroke=0, fill=0)
        path, transform = gc.get_clip_path()
        if path is not None:
            canvas.clipPath(_shape(canvas, path.iter_segments(transform)), stroke=0, fill=0)


def draw_string(canvas: Canvas, y: float, text: str, font: str, size: float, x: float = 0.0) -> None:
    """Draw one line of text with the fonts that its letters need."""
    for run, wide in runs(text):
        name = wide_font() if wide else font
        canvas.setFont(name, size)
        canvas.drawString(x, y, run)
        x += pdfmetrics.stringWidth(run, name, size)


def _alpha(gc: Any, colour: Any) -> float:
    if gc.get_forced_alpha() or len(colour) < 4:
        return float(gc.get_alpha())
    return float(colour[3])


def _set_stroke(canvas: Canvas, gc: Any) -> None:
    canvas.setStrokeColorRGB(*(float(c) for c in gc.get_rgb()[:3]), alpha=_alpha(gc, gc.get_rgb()))
    canvas.setLineWidth(float(gc.get_linewidth()))
    canvas.setLineCap(_CAPS[str(gc.get_capstyle())])
    canvas.setLineJoin(_JOINS[str(gc.get_joinstyle())])
    offset, dashes = gc.get_dashes()
    if dashes is not None:
        canvas.setDash([float(d) for d in dashes], float(offset or 0))


def _shape(canvas: Canvas, segments: Any) -> Any:
    """Convert a path for ReportLab; quadratic curves become cubic."""
    shape, x, y = canvas.beginPath(), 0.0, 0.0
    for points, code in segments:
        p = [float(v) for v in points]
        if code == _MOVE:
            shape.moveTo(*p)
        elif code == _LINE:
            shape.lineTo(*p)
        elif code == _CURVE3:
            c, e = p[:2], p[2:]
            near = [(a + 2 * b) / 3 for a, b in zip((x, y), c)]
            far = [(a + 2 * b) / 3 for a, b in zip(e, c)]
            shape.curveTo(*near, *far, *e)
        elif code == _CURVE4:
            shape.curveTo(*p)
        elif code == _CLOSE:
            shape.close()
            continue
        x, y = p[-2:]
    return shape
