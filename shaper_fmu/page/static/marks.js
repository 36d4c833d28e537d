/* What is drawn in a chart beside its curves: bands, levels, marks, stems, symbols; and how a line looks, beside its name. */

"use strict";

const CHART_DASHES = [[], [8, 5], [10, 4, 2, 4], [2, 4], [14, 4], [6, 3, 2, 3, 2, 3], [1, 3]];

/* Dash and colour of a style are another pair for 49 styles. */
function chartDash(style) {
  const count = CHART_DASHES.length;
  return CHART_DASHES[(style + Math.floor(style / count)) % count];
}

/* Corners of the symbols, in radii. */
const CHART_SYMBOLS = {
  circle: null,
  square: [[-0.9, -0.9], [0.9, -0.9], [0.9, 0.9], [-0.9, 0.9]],
  diamond: [[0, -1.3], [1.1, 0], [0, 1.3], [-1.1, 0]],
  "triangle-up": [[0, -1.2], [1.15, 0.9], [-1.15, 0.9]],
  cross: [[-0.4, -1.2], [0.4, -1.2], [0.4, -0.4], [1.2, -0.4], [1.2, 0.4], [0.4, 0.4], [0.4, 1.2], [-0.4, 1.2], [-0.4, 0.4], [-1.2, 0.4], [-1.2, -0.4], [-0.4, -0.4]],
}; // prettier-ignore

function chartSymbol(path, name, x, y, radius) {
  const corners = CHART_SYMBOLS[name];
  if (!corners) {
    path.moveTo(x + radius, y);
    path.arc(x, y, radius, 0, 2 * Math.PI);
    return;
  }
  corners.forEach(([dx, dy], k) => path[k ? "lineTo" : "moveTo"](x + radius * dx, y + radius * dy));
  path.closePath();
}

/* Draws each point of a line as this symbol of so many pixels. */
function chartSymbols(name, size) {
  return (u, i, first, last) => {
    const fill = new Path2D();
    const { scale } = u.series[i];
    for (let k = first; k <= last; k++) {
      const y = u.data[i][k];
      if (y === null || y === undefined) continue;
      chartSymbol(fill, name, u.valToPos(u.data[0][k], "x", true), u.valToPos(y, scale, true), 0.5 * size * devicePixelRatio);
    }
    return { stroke: null, fill, clip: null, flags: 3 };
  };
}

/* A line from 0 to each value. */
function chartStems(u, i, first, last) {
  const stroke = new Path2D();
  const { scale } = u.series[i];
  const zero = u.valToPos(0, scale, true);
  for (let k = first; k <= last; k++) {
    if (u.data[i][k] === null || u.data[i][k] === undefined) continue;
    const x = u.valToPos(u.data[0][k], "x", true);
    stroke.moveTo(x, zero);
    stroke.lineTo(x, u.valToPos(u.data[i][k], scale, true));
  }
  return { stroke, fill: null, clip: null };
}

/* A line that goes back and forth. */
function chartTrace(u, i, { x, y }) {
  const stroke = new Path2D();
  const { scale } = u.series[i];
  let down = false;
  for (let k = 0; k < x.length; k++) {
    const there = x[k] !== null && y[k] !== null;
    if (there) stroke[down ? "lineTo" : "moveTo"](u.valToPos(x[k], "x", true), u.valToPos(y[k], scale, true));
    down = there;
  }
  return { stroke, fill: null, clip: null };
}

/* Room of a vertical axis: for the longest of its numbers. */
function chartRoom(u, numbers) {
  const longest = Math.max(...(numbers ?? []).map((one) => one.length), 0);
  return Math.max(58, 7.5 * longest + 14);
}

/* An axis above a chart, with ticks at round numbers of another unit. */
function chartBeside(unit, factor, log) {
  const round = (u, _, low, high) => {
    const rough = ((high - low) * factor) / Math.max(1, u.width / 90); // a number needs so many pixels
    const power = 10 ** Math.floor(Math.log10(rough));
    const step = power * [1, 2, 2.5, 5, 10].find((one) => one * power >= rough * (1 - 1e-9));
    const first = Math.ceil((low * factor) / step - 1e-9);
    const count = Math.floor((high * factor) / step + 1e-9) - first + 1;
    return Array.from({ length: Math.max(count, 0) }, (__, k) => ((first + k) * step) / factor);
  };
  const values = (_, ticks) => ticks.map((one) => (one === null ? "" : `${chartNumber(one * factor)} ${unit}`));
  return chartAxis({ scale: "x", side: 0, size: 24, grid: { show: false }, values, ...(log ? {} : { splits: round }) });
}

function chartBands({ ctx, bbox, valToPos }, bands) {
  ctx.save();
  ctx.beginPath();
  ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
  ctx.clip();
  for (const [low, high] of bands) {
    const [left, right] = [low, high].map((x) => valToPos(x, "x", true));
    ctx.fillStyle = chartInk(0.07);
    ctx.fillRect(left, bbox.top, right - left, bbox.height);
    ctx.strokeStyle = chartInk(0.25); // hatched, so that it is seen in print
    ctx.beginPath();
    for (let x = left - bbox.height; x < right; x += 12 * devicePixelRatio) {
      const [from, to] = [Math.max(x, left), Math.min(x + bbox.height, right)];
      if (to <= from) continue;
      ctx.moveTo(from, bbox.top + bbox.height - (from - x));
      ctx.lineTo(to, bbox.top + bbox.height - (to - x));
    }
    ctx.globalAlpha = 0.35;
    ctx.stroke();
    ctx.globalAlpha = 1;
  }
  ctx.restore();
}

/* Horizontal lines at levels, vertical ones at marks, with their texts. */
function chartLevels({ ctx, bbox, valToPos }, levels, marks) {
  const ratio = devicePixelRatio;
  const [right, bottom] = [bbox.left + bbox.width, bbox.top + bbox.height];
  ctx.save();
  ctx.lineWidth = ratio;
  ctx.font = `${11 * ratio}px system-ui, sans-serif`;
  ctx.strokeStyle = chartInk(0.6);
  ctx.fillStyle = chartInk(0.8);
  ctx.setLineDash([4 * ratio, 4 * ratio]);
  const inside = (x, y) => x >= bbox.left - 1 && x <= right + 1 && y >= bbox.top - 1 && y <= bottom + 1;
  const line = (x1, y1, x2, y2) => (ctx.beginPath(), ctx.moveTo(x1, y1), ctx.lineTo(x2, y2), ctx.stroke());
  for (const [value, text] of levels) {
    const y = valToPos(value, "y", true);
    if (!inside(bbox.left, y)) continue;
    line(bbox.left, y, right, y);
    ctx.textAlign = "right";
    ctx.fillText(text, right - 4 * ratio, y - 4 * ratio > bbox.top + 10 * ratio ? y - 4 * ratio : y + 12 * ratio);
  }
  let row = 0;
  for (const [value, text, solid] of marks) {
    const x = valToPos(value, "x", true);
    if (!inside(x, bbox.top)) continue;
    ctx.setLineDash(solid ? [] : [4 * ratio, 4 * ratio]);
    line(x, bbox.top, x, bottom);
    const onLeft = x + ctx.measureText(text).width + 6 > right;
    ctx.textAlign = onLeft ? "right" : "left";
    ctx.fillText(text, x + (onLeft ? -4 : 4) * ratio, bbox.top + (12 + 13 * (row++ % 4)) * ratio);
  }
  ctx.restore();
}

/* How a line looks: colour, dash, symbol. */
function chartSample(line, style) {
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  svg.setAttribute("viewBox", "0 0 34 10");
  svg.setAttribute("width", 34);
  svg.setAttribute("height", 10);
  svg.setAttribute("aria-hidden", "true");
  const colour = `var(--chart-${style % CHART_COLOURS.light.length})`;
  const joined = `<path d="M0 5H34" stroke="${colour}" stroke-width="2.5" stroke-dasharray="${chartDash(style).join(" ")}"/>`;
  const corners = CHART_SYMBOLS[line.symbols] ?? null;
  const points = (corners ?? []).map(([x, y]) => `${17 + 3.4 * x},${5 + 3.4 * y}`).join(" ");
  const symbol = corners ? `<polygon points="${points}" fill="${colour}"/>` : `<circle cx="17" cy="5" r="3.4" fill="${colour}"/>`;
  const stem = `<path d="M17 10V4" stroke="${colour}" stroke-width="2"/><circle cx="17" cy="4" r="3" stroke="${colour}" fill="none" stroke-width="2"/>`;
  svg.innerHTML = line.stems ? stem : line.symbols ? symbol : joined + (line.values ? symbol : "");
  return svg;
}
