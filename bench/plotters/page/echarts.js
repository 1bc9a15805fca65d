import * as echarts from "/node_modules/echarts/dist/echarts.esm.mjs";
import { DB, hz } from "./work.js";

// It has no band: a line that is not visible carries the width of the band as an area.
function series({ db, low, high }) {
  const line = { type: "line", showSymbol: false, silent: true };
  return [
    { ...line, data: hz.map((f, i) => [f, low[i]]), lineStyle: { opacity: 0 }, stack: "band", stackStrategy: "all" },
    {
      ...line,
      data: hz.map((f, i) => [f, high[i] - low[i]]),
      lineStyle: { opacity: 0 },
      areaStyle: { color: "#06c", opacity: 0.25 },
      stack: "band",
      stackStrategy: "all",
    },
    { ...line, data: hz.map((f, i) => [f, db[i]]), lineStyle: { width: 1, color: "#06c" } },
  ];
}

export async function make(host, row) {
  const made = echarts.init(host);
  const [min, max] = DB;
  made.setOption({
    animation: false,
    grid: { left: 40, right: 10, top: 10, bottom: 30 },
    xAxis: { type: "log", min: hz[0], max: hz.at(-1) },
    yAxis: { type: "value", min, max },
    series: series(row),
  });
  return (next) => made.setOption({ series: series(next) });
}
