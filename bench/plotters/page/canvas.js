// No library: the same lines, band, grid and labels by hand, as the least that a canvas costs.
import { DB, hz, LINES } from "./work.js";

const [LEFT, BOTTOM, TOP, RIGHT] = [50, 50, 15, 10],
  decades = Math.log10(hz[LINES - 1] / hz[0]);

export async function make(host, first) {
  const canvas = host.appendChild(document.createElement("canvas")),
    [width, height] = [host.clientWidth, host.clientHeight];
  Object.assign(canvas, { width, height });
  const to = canvas.getContext("2d");
  const x = hz.map((f) => LEFT + ((width - LEFT - RIGHT) * Math.log10(f / hz[0])) / decades);
  const y = (db) => height - BOTTOM - ((height - TOP - BOTTOM) * (db - DB[0])) / (DB[1] - DB[0]);
  const path = (values, from = 0, to_ = LINES, step = 1) => {
    for (let i = from; i !== to_; i += step) to.lineTo(x[i], y(values[i]));
  };
  const draw = ({ db, low, high }) => {
    to.clearRect(0, 0, width, height);
    to.strokeStyle = "#0002";
    to.fillStyle = "#000";
    to.font = "12px sans-serif";
    for (let v = DB[0]; v <= DB[1]; v += 10) {
      to.beginPath();
      to.moveTo(LEFT, y(v));
      to.lineTo(width - RIGHT, y(v));
      to.stroke();
      to.fillText(String(v), LEFT - 30, y(v) + 4);
    }
    for (const decade of [10, 100])
      for (let k = 1; k < 10; k++) {
        const at = LEFT + ((width - LEFT - RIGHT) * Math.log10((decade * k) / hz[0])) / decades;
        if (at > width - RIGHT) break;
        to.beginPath();
        to.moveTo(at, TOP);
        to.lineTo(at, height - BOTTOM);
        to.stroke();
        if (k === 1) to.fillText(String(decade), at - 8, height - BOTTOM + 18);
      }
    to.fillStyle = "#06c4";
    to.beginPath();
    path(low);
    path(high, LINES - 1, -1, -1);
    to.fill();
    to.strokeStyle = "#06c";
    to.beginPath();
    path(db);
    to.stroke();
  };
  draw(first);
  return draw;
}
