import type { MatrixNames, Sent } from "./messages.js";

/** One matrix; see page.py. */
export interface MatrixAnswer extends MatrixNames {
  frequency_hz: number[];
  time_s: number;
  dof: Sent;
  /** by output and input; `reach` is 3σ/|G| */
  entries: { db: Sent[]; reach: Sent[]; unit: string }[][];
  /** of each input: lines at which its column is invalid, by reason */
  reasons: Partial<Record<"incomplete" | "not excited" | "not separated", number>>[];
  singular_db: Sent[][];
  condition: Sent[];
  coherence: Sent[][];
}
