import { ChartGPU, createPipelineCache } from "/node_modules/chartgpu/dist/index.js";
import { DB, hz } from "./work.js";

const adapter = await navigator.gpu?.requestAdapter();
if (!adapter) throw new Error("this browser has no WebGPU");
const device = await adapter.requestDevice(),
  shared = { adapter, device, pipelineCache: createPipelineCache(device) };

/** Why it draws nothing any more. @type {string | null} */
let lost = null;
device.lost.then(({ message }) => {
  lost = message;
});

const options = ({ db, low, high }) => ({
  animation: false,
  tooltip: { show: false },
  xAxis: { type: "log", min: hz[0], max: hz.at(-1) },
  yAxis: { type: "value", min: DB[0], max: DB[1] },
  series: [
    { type: "band", data: { x: hz, y: low, y1: high }, areaStyle: { color: "#0066cc", opacity: 0.25 } },
    { type: "line", data: { x: hz, y: db }, lineStyle: { width: 1, color: "#0066cc" }, sampling: "none" },
  ],
});

export async function make(host, first) {
  const made = await ChartGPU.create(host, options(first), shared);
  return (row) => {
    if (lost) throw new Error(`the WebGPU device is lost: ${lost}`);
    made.setOption(options(row));
  };
}
