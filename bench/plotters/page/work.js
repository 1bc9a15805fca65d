// What each library draws: a magnitude plot of 101 lines with its band, logarithmic in frequency, for each axis.

export const LINES = 101,
  DB = [-40, 40],
  ROWS = 64;
const [LOW_HZ, HIGH_HZ] = [5, 500];

export const hz = Array.from({ length: LINES }, (_, i) => LOW_HZ * (HIGH_HZ / LOW_HZ) ** (i / (LINES - 1)));

/** One magnitude of two masses with noise, in dB. */
function row() {
  const db = hz.map((f) => {
    const s2 = -((2 * Math.PI * f) ** 2);
    const above = Math.hypot(s2 + 2e5, 20 * Math.sqrt(-s2)),
      below = Math.sqrt(-s2) * Math.hypot(s2 + 4e5, 25 * Math.sqrt(-s2));
    return 20 * Math.log10((above / below) * 400) + Math.random() - 0.5;
  });
  return { db, low: db.map((v) => v - 1), high: db.map((v) => v + 1) };
}

/** Offer each chart a new response `perSecond` times a second; what is not drawn in time is left out. */
export async function run(make, axes, perSecond, seconds) {
  const rows = Array.from({ length: ROWS }, row),
    grid = document.createElement("main"),
    columns = Math.ceil(Math.sqrt(axes));
  grid.style.cssText = `display:grid;grid-template-columns:repeat(${columns},1fr);height:100vh`;
  grid.style.gridAutoRows = `${100 / Math.ceil(axes / columns)}vh`;
  document.body.replaceChildren(grid);
  const hosts = Array.from({ length: axes }, () => grid.appendChild(document.createElement("div")));
  const draws = [];
  for (const host of hosts) draws.push(await make(host, rows[0]));
  const frame = () => new Promise(requestAnimationFrame);
  let [updates, busy] = [0, 0];
  await frame();
  const begin = performance.now();
  const end = begin + 1e3 * seconds;
  for (let due = begin; performance.now() < end; ) {
    const now = await frame();
    if (now < due) continue;
    due = Math.max(due + 1e3 / perSecond, now - 1e3 / perSecond);
    const from = performance.now();
    for (const [i, draw] of draws.entries()) draw(rows[(updates + i) % ROWS]);
    await null; // some draw when the script is done
    busy += performance.now() - from;
    updates++;
  }
  const took = (performance.now() - begin) / 1e3;
  return { updates: updates / took, script: busy / updates };
}
