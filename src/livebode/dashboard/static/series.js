// One parameter over time, thinned if it is long.
const POINTS_MAX = 1500;
const number = (v) => (v === null ? NaN : v);

export class Series {
  constructor({ model, name, unit }) {
    Object.assign(this, { model, name, unit, t: [], v: [], s: [], status: [] });
  }

  // Take all rows at first, later the newest row.
  take(trend) {
    trend.time_s.forEach((t, i) => {
      if (this.t.length && t <= this.t.at(-1)) return;
      this.t.push(t);
      this.v.push(number(trend.value[i]));
      this.s.push(number(trend.sigma[i]));
      this.status.push(trend.status[i]);
    });
    if (this.t.length > POINTS_MAX)
      for (const name of ["t", "v", "s", "status"])
        this[name] = this[name].filter((_, i) => i % 2 === 0 || i === this[name].length - 1);
  }

  // Index of the row nearest to a time; without a time, of the newest row.
  at(timeS) {
    if (!Number.isFinite(timeS)) return this.t.length - 1;
    let best = 0;
    this.t.forEach((t, i) => {
      if (Math.abs(t - timeS) < Math.abs(this.t[best] - timeS)) best = i;
    });
    return best;
  }

  // The same, but without a time the newest row with a value.
  known(timeS) {
    let at = this.at(timeS);
    if (!Number.isFinite(timeS)) while (at > 0 && !Number.isFinite(this.v[at])) at--;
    return at;
  }
}
