// It draws lines alone: no band, no axes, no labels, so this is less work than the others do.
import { ColorRGBA, WebglLine, WebglPlot } from "/node_modules/webgl-plot/dist/webglplot.esm.mjs";
import { DB, hz, LINES } from "./work.js";

const middle = (DB[0] + DB[1]) / 2,
  half = (DB[1] - DB[0]) / 2,
  decades = Math.log10(hz[LINES - 1] / hz[0]);

export async function make(host, first) {
  const canvas = host.appendChild(document.createElement("canvas"));
  Object.assign(canvas, { width: host.clientWidth, height: host.clientHeight });
  const made = new WebglPlot(canvas);
  const lines = [1, 0.4, 0.4].map((alpha) => {
    const line = new WebglLine(new ColorRGBA(0, 0.4, 0.8, alpha), LINES);
    for (const [i, f] of hz.entries()) line.setX(i, (2 * Math.log10(f / hz[0])) / decades - 1);
    made.addLine(line);
    return line;
  });
  const draw = ({ db, low, high }) => {
    for (const [k, values] of [db, low, high].entries())
      for (let i = 0; i < LINES; i++) lines[k].setY(i, (values[i] - middle) / half);
    made.update();
  };
  draw(first);
  return draw;
}
