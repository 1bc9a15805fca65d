import "/node_modules/chart.js/dist/chart.umd.js";
import { DB, hz } from "./work.js";

const points = (values) => hz.map((x, i) => ({ x, y: values[i] }));

export async function make(host, { db, low, high }) {
  const plain = { pointRadius: 0, borderWidth: 0 };
  const made = new globalThis.Chart(host.appendChild(document.createElement("canvas")), {
    type: "line",
    data: {
      datasets: [
        { ...plain, data: points(low) },
        { ...plain, data: points(high), fill: "-1", backgroundColor: "#06c4" },
        { ...plain, data: points(db), borderWidth: 1, borderColor: "#06c" },
      ],
    },
    options: {
      animation: false,
      parsing: false,
      normalized: true,
      maintainAspectRatio: false,
      plugins: { legend: { display: false } },
      scales: { x: { type: "logarithmic", min: hz[0], max: hz.at(-1) }, y: { min: DB[0], max: DB[1] } },
    },
  });
  return (row) => {
    for (const [i, values] of [row.low, row.high, row.db].entries()) made.data.datasets[i].data = points(values);
    made.update("none");
  };
}
