/* Lines with horizontal values of their own, for uPlot, which wants one row of them for all lines. */

"use strict";

/* The row of all values of x, rising, and for each line a row with its values there: undefined where it has none, null where the
   line has a gap. A value that a line has twice, where it jumps, is there twice. A line that goes back and forth is sorted in its
   row, and is in `traces` as it goes. */
function chartJoin(xs, ys) {
  const traces = xs.map((x, i) => (chartRises(x) ? null : { x, y: ys[i] }));
  const lines = xs.map((x, i) => chartSorted(x, ys[i]));
  const counts = new Map();
  for (const [x] of lines) {
    chartCopies(x, (value, _, copy) => {
      if (copy >= (counts.get(value) ?? 0)) counts.set(value, copy + 1);
    });
  }
  const all = [];
  const places = new Map();
  for (const value of [...counts.keys()].sort((a, b) => a - b)) {
    places.set(value, all.length);
    for (let copy = 0; copy < counts.get(value); copy++) all.push(value);
  }
  const rows = lines.map(([x, y]) => {
    const row = new Array(all.length).fill(undefined);
    chartCopies(x, (value, k, copy) => (row[places.get(value) + copy] = y[k]));
    if (y.includes(null)) chartWiden(row);
    return row;
  });
  return { data: [all, ...rows], traces };
}

/* Gaps up to the line's own values beside them. */
function chartWiden(row) {
  for (let k = 1; k < row.length; k++) if (row[k] === undefined && row[k - 1] === null) row[k] = null;
  for (let k = row.length - 2; k >= 0; k--) if (row[k] === undefined && row[k + 1] === null) row[k] = null;
}

/* Calls with each value, its place, and which of several equal ones it is. */
function chartCopies(x, call) {
  let copy = 0;
  for (let k = 0; k < x.length; k++) {
    copy = k > 0 && x[k] === x[k - 1] ? copy + 1 : 0;
    call(x[k], k, copy);
  }
}

function chartRises(x) {
  return x.every((value, k) => value !== null && (k === 0 || value >= x[k - 1]));
}

function chartSorted(x, y) {
  if (chartRises(x)) return [x, y];
  const order = Array.from(x.keys()).filter((k) => x[k] !== null).sort((a, b) => x[a] - x[b] || a - b);
  return [order.map((k) => x[k]), order.map((k) => y[k])];
}
