/* Charts of a page: curves over one horizontal axis, drawn by uPlot (MIT, Leon Sorokin).

     const chart = new Chart(element, { title, x: "time [s]", y: "position [m]", lines: [{ name: "command" }, ...] });
     chart.draw(time, [command, ...], { levels: [[0.05, "5 %"]], marks: [[9.4, "mode"]], bands: [[8, 11, "tolerated"]] });

   A line may have { style: n } (lines of one style look the same in every chart), { right: true } (axis on the right, `right` is its
   label), { stems: true } (impulses), { symbols: true } (points without a line between them), { values: true } (markers on the line).
   Where the lines have times of their own, `draw` takes a list of them, one for each line.

   `range` and `xRange` of the options are functions that make the axes' ends of the lines' (low, high).

   Lines differ in colour and dash (Okabe and Ito's palette). Dragging over a chart zooms, a double click or Escape shows all; the
   pointer, a finger or the arrow keys show values below it; a click or Enter on a line's name hides it; "picture" and "table"
   download the chart. */

"use strict";

const CHART_COLOURS = {
  light: ["#0072B2", "#D55E00", "#009E73", "#AA3377", "#8A6100", "#3489BD", "#000000"],
  dark: ["#56B4E9", "#FF8A3D", "#2FC79B", "#E58CBF", "#E6B020", "#9BD1F5", "#F2F2F2"],
};
const CHART_DASHES = [[], [8, 5], [10, 4, 2, 4], [2, 4], [14, 4], [6, 3, 2, 3, 2, 3], [1, 3]];
const CHART_HEIGHT = 260;

function chartIsDark() {
  return getComputedStyle(document.documentElement).colorScheme.includes("dark") && matchMedia("(prefers-color-scheme: dark)").matches;
}

function chartNumber(value) {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  return String(Number(value.toPrecision(5))).replace("-", "−");
}

class Chart {
  constructor(element, options) {
    this.element = element;
    this.options = { height: CHART_HEIGHT, lines: [], ...options };
    this.extras = { levels: [], marks: [], bands: [] };
    this.zoomed = false;
    this.element.classList.add("chart");
    this.plot = new uPlot(this.settings(), [[], ...this.options.lines.map(() => [])], this.element);
    this.makeAccessible();
    this.addDownloads();
    new ResizeObserver(() => this.fit()).observe(this.element);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.plot.redraw(false));
    addEventListener("beforeprint", () => this.plot.redraw(false));
  }

  /* Shows these values; a zoom stays. */
  draw(x, lines, extras = {}) {
    this.extras = { levels: [], marks: [], bands: [], ...extras };
    const apart = Array.isArray(x[0]) || ArrayBuffer.isView(x[0]);
    const data = apart ? uPlot.join(x.map((one, i) => [one, lines[i]])) : [x, ...lines];
    this.plot.batch(() => {
      const { min, max } = this.plot.scales.x;
      this.plot.setData(data, !this.zoomed);
      if (this.zoomed) this.plot.setScale("x", { min, max });
    });
  }

  /* Shows the whole of it again. */
  showAll() {
    this.zoomed = false;
    this.plot.setData(this.plot.data, true);
  }

  /* Another text of the vertical axis. */
  label(text) {
    if (this.plot.axes[1].label === text) return;
    this.plot.axes[1].label = text;
    this.plot.redraw(false, true);
  }

  colour(i) {
    const palette = CHART_COLOURS[chartIsDark() ? "dark" : "light"];
    return palette[(this.options.lines[i].style ?? i) % palette.length];
  }

  ink(share) {
    const grey = chartIsDark() ? 255 : 0;
    return `rgba(${grey}, ${grey}, ${grey}, ${share})`;
  }

  settings() {
    const { options } = this;
    const axis = (more) => ({
      stroke: () => this.ink(0.85),
      grid: { stroke: () => this.ink(0.12), width: 1 },
      ticks: { stroke: () => this.ink(0.25), width: 1, size: 5 },
      font: "12px system-ui, sans-serif",
      labelFont: "13px system-ui, sans-serif",
      labelSize: 20,
      ...more,
    });
    const upright = { size: 58, values: (_, ticks) => ticks.map(chartNumber) };
    const axes = [axis({ label: options.x, size: 32, values: (_, ticks) => ticks.map((one) => (one === null ? "" : chartNumber(one))) })];
    axes.push(axis({ label: options.y, ...upright }));
    const range = (u, low, high) => this.range(low, high);
    const scales = { x: { time: false, distr: options.logX ? 3 : 1 }, y: { range } };
    if (options.xRange) scales.x.range = (u, low, high) => (this.zoomed ? [low, high] : options.xRange(low, high));
    if (options.right) {
      axes.push(axis({ label: options.right, ...upright, side: 1, scale: "right", grid: { show: false } }));
      scales.right = { range };
    }
    const unit = (options.x.match(/\[(.*)\]/) ?? ["", ""])[1];
    const series = options.lines.map((line, i) => this.series(line, i));
    return {
      width: Math.max(this.element.clientWidth, 120),
      height: options.height,
      scales,
      axes,
      series: [{ label: options.x.replace(/ *\[.*/, ""), value: (_, x) => `${chartNumber(x)} ${unit}` }, ...series],
      cursor: { drag: { x: true, y: false, dist: 5 }, points: { size: 7 } },
      hooks: {
        drawClear: [(u) => this.drawBands(u)],
        draw: [(u) => this.drawLevels(u)],
        setSelect: [(u) => (this.zoomed = u.select.width > 0 || this.zoomed)],
      },
    };
  }

  series(line, i) {
    const dash = CHART_DASHES[(line.style ?? i) % CHART_DASHES.length];
    const base = { label: line.name, stroke: () => this.colour(i), scale: line.right ? "right" : "y", width: 2, spanGaps: true };
    const value = (_, y) => chartNumber(y);
    const points = { show: Boolean(line.stems || line.symbols || line.values), size: line.stems ? 9 : 6, fill: () => this.colour(i) };
    if (line.stems) return { ...base, value, points, paths: chartStems };
    return { ...base, value, points, dash, paths: line.symbols ? () => null : line.steps ? uPlot.paths.stepped({ align: 1 }) : undefined };
  }

  /* The vertical axis includes 0, all of the lines, and some room. */
  range(low, high) {
    if (this.options.range) return this.options.range(low, high);
    if (low === null || high === null) return [0, 1];
    const [bottom, top] = [Math.min(low, 0), Math.max(high, 0)];
    const room = 0.06 * (top - bottom || 1);
    return [bottom < 0 ? bottom - room : 0, top > 0 ? top + room : 0.06];
  }

  drawBands(u) {
    const { ctx, bbox } = u;
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    for (const [low, high] of this.extras.bands) {
      const [left, right] = [low, high].map((x) => u.valToPos(x, "x", true));
      ctx.fillStyle = this.ink(0.07);
      ctx.fillRect(left, bbox.top, right - left, bbox.height);
      ctx.strokeStyle = this.ink(0.25); // hatched, so that it is seen in print
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

  drawLevels(u) {
    const { ctx, bbox } = u;
    ctx.save();
    ctx.lineWidth = devicePixelRatio;
    ctx.font = `${11 * devicePixelRatio}px system-ui, sans-serif`;
    ctx.strokeStyle = this.ink(0.6);
    ctx.fillStyle = this.ink(0.8);
    ctx.setLineDash([4 * devicePixelRatio, 4 * devicePixelRatio]);
    const inside = (x, y) => x >= bbox.left - 1 && x <= bbox.left + bbox.width + 1 && y >= bbox.top - 1 && y <= bbox.top + bbox.height + 1;
    const line = (x1, y1, x2, y2) => (ctx.beginPath(), ctx.moveTo(x1, y1), ctx.lineTo(x2, y2), ctx.stroke());
    for (const [value, text] of this.extras.levels) {
      const y = u.valToPos(value, "y", true);
      if (!inside(bbox.left, y)) continue;
      line(bbox.left, y, bbox.left + bbox.width, y);
      ctx.textAlign = "right";
      ctx.fillText(text, bbox.left + bbox.width - 4 * devicePixelRatio, y - 4 * devicePixelRatio);
    }
    let row = 0;
    for (const [value, text, solid] of this.extras.marks) {
      const x = u.valToPos(value, "x", true);
      if (!inside(x, bbox.top)) continue;
      ctx.setLineDash(solid ? [] : [4 * devicePixelRatio, 4 * devicePixelRatio]);
      line(x, bbox.top, x, bbox.top + bbox.height);
      const onLeft = x + ctx.measureText(text).width + 6 > bbox.left + bbox.width;
      ctx.textAlign = onLeft ? "right" : "left";
      ctx.fillText(text, x + (onLeft ? -4 : 4) * devicePixelRatio, bbox.top + (12 + 13 * (row++ % 4)) * devicePixelRatio);
    }
    ctx.restore();
  }

  fit() {
    const width = this.element.clientWidth;
    if (width > 0 && width !== this.plot.width) this.plot.setSize({ width, height: this.options.height });
  }

  /* Keys and fingers; names of lines as buttons. */
  makeAccessible() {
    const { plot } = this;
    const { over } = plot;
    over.tabIndex = 0;
    over.setAttribute("role", "img");
    over.setAttribute("aria-label", `${this.options.title ?? this.options.y}. Arrow keys show values, Escape shows all.`);
    over.style.touchAction = "pan-y";
    over.addEventListener("dblclick", () => (this.zoomed = false));
    over.addEventListener("pointermove", (event) => {
      if (event.pointerType !== "touch") return;
      const place = over.getBoundingClientRect();
      plot.setCursor({ left: event.clientX - place.left, top: event.clientY - place.top });
    });
    over.addEventListener("keydown", (event) => {
      if (event.key === "Escape") this.showAll();
      const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
      if (!step) return;
      event.preventDefault();
      const { min, max } = plot.scales.x;
      const now = plot.cursor.left >= 0 ? plot.posToVal(plot.cursor.left, "x") : 0.5 * (min + max);
      const next = Math.min(max, Math.max(min, now + step * (max - min) * (event.shiftKey ? 0.05 : 0.005)));
      plot.setCursor({ left: plot.valToPos(next, "x"), top: 0.5 * over.clientHeight });
    });
    this.element.querySelectorAll(".u-legend .u-series").forEach((row, i) => {
      const name = row.querySelector("th");
      if (i === 0) return;
      name.tabIndex = 0;
      name.setAttribute("role", "button");
      name.title = "show or hide";
      name.prepend(this.sample(i - 1));
      name.addEventListener("keydown", (event) => {
        if (event.key !== "Enter" && event.key !== " ") return;
        event.preventDefault();
        name.click();
      });
    });
  }

  /* How a line looks, beside its name: colour and dash. */
  sample(i) {
    const line = this.options.lines[i];
    const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
    svg.setAttribute("viewBox", "0 0 34 10");
    svg.setAttribute("width", 34);
    svg.setAttribute("height", 10);
    svg.setAttribute("aria-hidden", "true");
    const stroke = `stroke="var(--chart-${(line.style ?? i) % CHART_COLOURS.light.length})"`;
    const dash = CHART_DASHES[(line.style ?? i) % CHART_DASHES.length].join(" ");
    svg.innerHTML =
      line.stems || line.symbols
        ? `<path d="M17 10V4" ${stroke} stroke-width="2"/><circle cx="17" cy="4" r="3" ${stroke} fill="none" stroke-width="2"/>`
        : `<path d="M0 5H34" ${stroke} stroke-width="2.5" stroke-dasharray="${dash}"/>`;
    return svg;
  }

  addDownloads() {
    const bar = document.createElement("div");
    bar.className = "chart-downloads";
    for (const [text, what] of [
      ["picture", () => this.savePicture()],
      ["table", () => this.saveTable()],
    ]) {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = text;
      button.title = `download as ${text === "picture" ? "PNG" : "CSV"}`;
      button.addEventListener("click", what);
      bar.append(button);
    }
    this.element.append(bar);
  }

  /* The chart with its lines' names, as PNG. */
  savePicture() {
    const { canvas } = this.plot.ctx;
    const ratio = devicePixelRatio;
    const drawn = document.createElement("canvas");
    [drawn.width, drawn.height] = [canvas.width, canvas.height + 26 * ratio];
    const ctx = drawn.getContext("2d");
    ctx.fillStyle = chartIsDark() ? "#15181c" : "#ffffff";
    ctx.fillRect(0, 0, drawn.width, drawn.height);
    ctx.drawImage(canvas, 0, 0);
    ctx.font = `${12 * ratio}px system-ui, sans-serif`;
    let x = 10 * ratio;
    const y = canvas.height + 14 * ratio;
    this.options.lines.forEach((line, i) => {
      if (!this.plot.series[i + 1].show) return;
      ctx.strokeStyle = ctx.fillStyle = this.colour(i);
      ctx.lineWidth = 2 * ratio;
      ctx.setLineDash(CHART_DASHES[(line.style ?? i) % CHART_DASHES.length].map((d) => d * ratio));
      ctx.beginPath();
      ctx.moveTo(x, y);
      ctx.lineTo(x + 30 * ratio, y);
      ctx.stroke();
      ctx.fillText(line.name, x + 36 * ratio, y + 4 * ratio);
      x += 50 * ratio + ctx.measureText(line.name).width;
    });
    drawn.toBlob((blob) => this.save(blob, "png"));
  }

  /* The values, as CSV. */
  saveTable() {
    const quoted = (text) => `"${text.replaceAll('"', '""')}"`;
    const head = [this.options.x, ...this.options.lines.map((line) => line.name)].map(quoted).join(",");
    const { data } = this.plot;
    const rows = Array.from(data[0], (_, i) => data.map((column) => column[i] ?? "").join(","));
    this.save(new Blob([[head, ...rows, ""].join("\n")], { type: "text/csv" }), "csv");
  }

  save(blob, ending) {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(blob);
    link.download = `${(this.options.title ?? "chart").replace(/\W+/g, "_")}.${ending}`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  }
}

/* A line from 0 to each value. */
function chartStems(u, i, first, last) {
  const stroke = new Path2D();
  const [zero, scale] = [u.valToPos(0, u.series[i].scale, true), u.series[i].scale];
  for (let k = first; k <= last; k++) {
    if (u.data[i][k] === null || u.data[i][k] === undefined) continue;
    const x = u.valToPos(u.data[0][k], "x", true);
    stroke.moveTo(x, zero);
    stroke.lineTo(x, u.valToPos(u.data[i][k], scale, true));
  }
  return { stroke, fill: null, clip: null };
}
