// The newest responses: times, schedule, and for each line magnitude, phase and reach; a ring buffer of bounded size.
const ROWS_MAX = 2400,
  CELLS_MAX = 1 << 20;

export class Rows {
  constructor(columns) {
    this.columns = columns;
    this.room = Math.max(64, Math.min(ROWS_MAX, Math.floor(CELLS_MAX / columns)));
    this.clear();
  }

  clear() {
    this.count = 0;
    this.next = 0;
    this.timeS = new Float64Array(this.room);
    this.schedule = new Float64Array(this.room);
    for (const name of ["magnitude", "phase", "reach"]) this[name] = new Float32Array(this.room * this.columns);
  }

  take(frame, wanted = () => true) {
    for (let r = Math.max(0, frame.rows - this.room); r < frame.rows; r++)
      if (wanted(frame.timeS[r])) this.put(frame, r);
  }

  put(from, r) {
    const at = this.next;
    this.timeS[at] = from.timeS[r];
    this.schedule[at] = from.schedule[r];
    for (const name of ["magnitude", "phase", "reach"])
      this[name].set(from[name].subarray(r * this.columns, (r + 1) * this.columns), at * this.columns);
    this.next = (at + 1) % this.room;
    this.count = Math.min(this.count + 1, this.room);
  }

  // These rows, preceded by the older rows of a frame.
  behind(frame) {
    const after = new Rows(this.columns),
      first = this.count ? this.timeS[this.order()[0]] : Infinity;
    after.take(frame, (timeS) => timeS < first);
    for (const at of this.order()) after.put(this, at);
    return after;
  }

  // Indices of the rows in order of arrival.
  order() {
    const first = (this.next - this.count + this.room) % this.room;
    return Array.from({ length: this.count }, (_, i) => (first + i) % this.room);
  }

  get lastS() {
    return this.count ? this.timeS[(this.next - 1 + this.room) % this.room] : NaN;
  }
}
