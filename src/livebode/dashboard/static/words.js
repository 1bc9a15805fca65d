// Numbers and names as people read them.
export function plain(value, digits = 4) {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  if (!Number.isFinite(value)) return value > 0 ? "∞" : "−∞";
  const text =
    Math.abs(value) >= 1e6 || (value !== 0 && Math.abs(value) < 1e-3)
      ? Number(value.toPrecision(digits)).toExponential().replace("e+", "e")
      : Number(value.toPrecision(digits)).toString();
  return text.replace("-", "−");
}

export const signed = (value, digits = 1) =>
  Number.isFinite(value) ? `${value < 0 ? "−" : "+"}${Math.abs(value).toFixed(digits)}` : "–";

export function hertz(f) {
  if (f >= 1e5) return `${Number((f / 1000).toPrecision(4))}k`;
  return Number(f.toPrecision(5)).toString();
}

// Times since 1970 are no ticks for an axis: what to subtract from them.
export const originOf = (firstS) => (Math.abs(firstS) >= 1e5 ? Math.floor(firstS) : 0);

export function moment(timeS) {
  if (!Number.isFinite(timeS)) return "–";
  if (Math.abs(timeS) > 1e8) return new Date(timeS * 1000).toISOString().slice(0, 19).replace("T", " ");
  const sign = timeS < 0 ? "−" : "",
    size = Math.abs(timeS);
  if (size < 120) return `${sign}${size.toFixed(2)} s`;
  const whole = Math.floor(size),
    hours = Math.floor(whole / 3600),
    minutes = Math.floor(whole / 60) % 60;
  return `${sign}${hours ? `${hours} h ` : ""}${minutes} min ${whole % 60} s`;
}

// "x in m" → name and unit.
export function named(label) {
  const cut = label.lastIndexOf(" in ");
  return cut < 0 ? { name: label, unit: "" } : { name: label.slice(0, cut), unit: label.slice(cut + 4) };
}
