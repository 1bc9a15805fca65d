import uPlot from "/node_modules/uplot/dist/uPlot.esm.js";
import { DB, hz } from "./work.js";

const style = document.head.appendChild(document.createElement("link"));
Object.assign(style, { rel: "stylesheet", href: "/node_modules/uplot/dist/uPlot.min.css" });

export async function make(host, { db, low, high }) {
  const made = new uPlot(
    {
      width: host.clientWidth,
      height: host.clientHeight,
      legend: { show: false },
      scales: { x: { time: false, distr: 3, range: [hz[0], hz.at(-1)] }, y: { range: DB } },
      series: [{}, { stroke: "#06c", width: 1 }, {}, {}],
      bands: [{ series: [3, 2], fill: "#06c4" }],
    },
    [hz, db, low, high],
    host,
  );
  return (row) => made.setData([hz, row.db, row.low, row.high]);
}
