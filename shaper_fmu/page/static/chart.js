/* Charts of a page: curves over one horizontal axis, drawn by uPlot (MIT, Leon Sorokin).

     const chart = new Chart(element, { title, x: "time [s]", y: "position [m]", lines: [{ name: "command" }, ...] });
     chart.draw(time, [command, ...], { levels: [[0.05, "5 %"]], marks: [[9.4, "mode"]], bands: [[8, 11, "tolerated"]] });

   A line may have { style: n } (lines of one style look the same in every chart), { right: true } (axis on the right, `right` is its
   label), { stems: true } (impulses), { symbols: "square" } (points without a line between them, see marks.js), { values: true }
   (markers on the line). Where the lines have times of their own, `draw` takes a list of them, one for each line (see join.js).

   { beside: ["Hz", 0.159] } is a second unit of the horizontal axis, with its factor: its ticks are above the chart, and values below
   it have both.

   `range` and `xRange` of the options are functions that make the axes' ends of the lines' (low, high); with { whole: true } levels
   and marks are in sight, too, and dragging zooms both axes.

   Lines differ in colour and dash (Okabe and Ito's palette). Dragging over a chart zooms, a double click or Escape shows all; the
   pointer, a finger or the arrow keys show values below it; a click or Enter on a line's name hides it; "picture" and "table"
   download the chart. */

"use strict";

const CHART_HEIGHT = 260;
const CHART_REACH = 25; // pixels from the pointer to a point that it shows

class Chart extends Downloads {
  constructor(element, options) {
    super(element, { height: CHART_HEIGHT, lines: [], ...options });
    this.extras = { levels: [], marks: [], bands: [] };
    this.zoomed = false;
    this.traces = [];
    this.plot = new uPlot(this.settings(), [[], ...this.options.lines.map(() => [])], this.element);
    this.makeAccessible();
    this.addDownloads();
    this.watch();
  }

  /* Shows these values; a zoom stays. */
  draw(x, lines, extras = {}) {
    this.extras = { levels: [], marks: [], bands: [], ...extras };
    const apart = Array.isArray(x[0]) || ArrayBuffer.isView(x[0]);
    const { data, traces } = apart ? chartJoin(x, lines) : { data: [x, ...lines], traces: [] };
    this.traces = traces;
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

  redraw() {
    this.plot.redraw(false);
  }

  fit(width) {
    if (width > 0 && width !== this.plot.width) this.plot.setSize({ width, height: this.options.height });
  }

  /* Another text of the vertical axis. */
  label(text) {
    if (this.plot.axes[1].label === text) return;
    this.plot.axes[1].label = text;
    this.plot.redraw(false, true);
  }

  style(i) {
    return this.options.lines[i].style ?? i;
  }

  colour(i) {
    const palette = CHART_COLOURS[chartIsDark() ? "dark" : "light"];
    return palette[this.style(i) % palette.length];
  }

  settings() {
    const { options } = this;
    const axes = [chartAxis({ label: options.x, size: 32 }), chartAxis({ label: options.y, size: chartRoom })];
    const scales = { x: { time: false, distr: options.logX ? 3 : 1 }, y: { range: (u, low, high) => this.range(low, high, this.extras.levels) } };
    if (options.xRange || options.whole) scales.x.range = (u, low, high) => (this.zoomed ? [low, high] : this.xRange(low, high));
    if (options.right) {
      axes.push(chartAxis({ label: options.right, size: chartRoom, side: 1, scale: "right", grid: { show: false } }));
      scales.right = { range: (u, low, high) => this.range(low, high, []) };
    }
    if (options.beside) axes.push(chartBeside(...options.beside, options.logX));
    const unit = (options.x.match(/\[(.*)\]/) ?? ["", ""])[1];
    const series = options.lines.map((line, i) => this.series(line, i));
    return {
      width: Math.max(this.element.clientWidth, 120),
      height: options.height,
      scales,
      axes,
      series: [{ label: options.x.replace(/ *\[.*/, ""), value: (_, x) => `${chartNumber(x)} ${unit}${this.besides(x)}` }, ...series],
      cursor: {
        drag: { x: true, y: Boolean(options.whole), dist: 5, uni: 40 },
        points: { size: 7 },
        dataIdx: (u, i, at, x) => (i === 0 ? at : options.lines[i - 1].symbols ? this.closest(u, i) : chartNearest(u, i, at, x)),
      },
      hooks: {
        drawClear: [(u) => chartBands(u, this.extras.bands)],
        draw: [(u) => chartLevels(u, this.extras.levels, this.extras.marks)],
        setSelect: [(u) => (this.zoomed = u.select.width > 0 || this.zoomed)],
      },
    };
  }

  /* A value of the horizontal axis in its second unit. */
  besides(x) {
    const { beside } = this.options;
    return beside && x !== null && x !== undefined ? ` (${chartNumber(x * beside[1])} ${beside[0]})` : "";
  }

  series(line, i) {
    const joined = { label: line.name, stroke: () => this.colour(i), scale: line.right ? "right" : "y", width: 2 };
    const value = (u, y, _, at) => (line.symbols && at !== null && y !== null ? `${chartNumber(y)} at ${chartNumber(u.data[0][at])}` : chartNumber(y));
    const shown = line.stems || line.symbols || line.values;
    const size = line.size ?? (line.stems ? 9 : 6);
    const points = { show: Boolean(shown), size, fill: () => this.colour(i) };
    if (line.stems) return { ...joined, value, points, paths: chartStems };
    if (shown) points.paths = chartSymbols(line.symbols, size);
    const straight = line.steps ? uPlot.paths.stepped({ align: 1 }) : uPlot.paths.linear();
    const paths = (u, k, ...ends) => (line.symbols ? null : this.traces[i] ? chartTrace(u, k, this.traces[i]) : straight(u, k, ...ends));
    return { ...joined, value, points, dash: chartDash(this.style(i)), paths };
  }

  /* The vertical axis includes 0, all of the lines, and some room. */
  range(low, high, levels) {
    if (this.options.range) return this.options.range(low, high);
    if (low === null || high === null) return [0, 1];
    const also = this.options.whole ? levels.map(([value]) => value) : [];
    const [bottom, top] = [Math.min(low, 0, ...also), Math.max(high, 0, ...also)];
    const room = 0.06 * (top - bottom || 1);
    return [bottom < 0 ? bottom - room : 0, top > 0 ? top + room : 0.06];
  }

  xRange(low, high) {
    const { options } = this;
    if (options.xRange) return options.xRange(low, high);
    if (low === null || high === null) return [options.logX ? 0.1 : 0, 1];
    const also = this.extras.marks.map(([value]) => value).filter((value) => !options.logX || value > 0);
    const [left, right] = [Math.min(low, ...also), Math.max(high, ...also)];
    const apart = options.lines.some((line) => line.symbols) || left === right ? 0.03 : 0;
    if (options.logX) {
      const factor = (left === right ? 10 : right / left) ** apart;
      return [left / factor, right * factor];
    }
    const room = apart * (right - left || Math.abs(left) || 1);
    return [left - room, right + room];
  }

  /* The point of a line that is closest to the pointer, if any is in its reach. */
  closest(u, i) {
    const { left, top } = u.cursor;
    let [found, least] = [null, CHART_REACH ** 2];
    u.data[i].forEach((y, k) => {
      if (y === null || y === undefined) return;
      const apart = (u.valToPos(u.data[0][k], "x") - left) ** 2 + (u.valToPos(y, u.series[i].scale) - top) ** 2;
      if (apart < least) [found, least] = [k, apart];
    });
    return found;
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
      const width = over.clientWidth;
      const now = plot.cursor.left >= 0 ? plot.cursor.left : 0.5 * width;
      const left = Math.min(width, Math.max(0, now + step * width * (event.shiftKey ? 0.05 : 0.005)));
      plot.setCursor({ left, top: 0.5 * over.clientHeight });
    });
    this.element.querySelectorAll(".u-legend .u-series").forEach((row, i) => {
      const name = row.querySelector("th");
      if (i === 0) return;
      name.tabIndex = 0;
      name.setAttribute("role", "button");
      name.title = "show or hide";
      name.prepend(chartSample(this.options.lines[i - 1], this.style(i - 1)));
      name.addEventListener("keydown", (event) => {
        if (event.key !== "Enter" && event.key !== " ") return;
        event.preventDefault();
        name.click();
      });
    });
  }

  /* The chart with its lines' names. */
  picture() {
    const { canvas } = this.plot.ctx;
    const names = this.options.lines.map((line, i) => [line, i]).filter(([, i]) => this.plot.series[i + 1].show);
    const rows = this.placed(names, canvas.width);
    const { drawn, ctx, top, ratio } = this.paper(canvas.width, canvas.height + (1 + rows.at(-1).row) * 20 * devicePixelRatio + 6 * devicePixelRatio);
    ctx.drawImage(canvas, 0, top);
    ctx.lineWidth = 2 * ratio;
    for (const { line, i, x, row } of rows.slice(0, -1)) {
      const y = top + canvas.height + (14 + 20 * row) * ratio;
      ctx.strokeStyle = ctx.fillStyle = this.colour(i);
      const path = new Path2D();
      if (line.symbols || line.values) chartSymbol(path, line.symbols, x + 15 * ratio, y, 4 * ratio);
      ctx.fill(path);
      ctx.setLineDash(chartDash(this.style(i)).map((d) => d * ratio));
      if (!line.symbols) ctx.stroke(new Path2D(`M${x} ${y}H${x + 30 * ratio}`));
      ctx.fillText(line.name, x + 36 * ratio, y + 4 * ratio);
    }
    return drawn;
  }

  /* Where each name is in the rows below the picture; the last entry tells the last row. */
  placed(names, width) {
    const ratio = devicePixelRatio;
    const { ctx } = this.plot;
    ctx.save();
    ctx.font = `${12 * ratio}px system-ui, sans-serif`;
    let [x, row] = [10 * ratio, 0];
    const found = names.map(([line, i]) => {
      const needed = 50 * ratio + ctx.measureText(line.name).width;
      if (x > 10 * ratio && x + needed > width) [x, row] = [10 * ratio, row + 1];
      x += needed;
      return { line, i, x: x - needed, row };
    });
    ctx.restore();
    return [...found, { row }];
  }

  /* The values, a column for each line. */
  rows() {
    const { data } = this.plot;
    const head = [this.options.x, ...this.options.lines.map((line) => line.name)];
    return [head, ...Array.from(data[0], (_, k) => data.map((column) => column[k]))];
  }
}

/* The place of a line's value that is nearest to x, on the line: there is none before its begin and after its end. */
function chartNearest(u, i, at, x) {
  const [time, column] = [u.data[0], u.data[i]];
  if (column[at] !== undefined) return at;
  let [before, after] = [at, at];
  while (before >= 0 && column[before] === undefined) before--;
  while (after < column.length && column[after] === undefined) after++;
  if (before < 0 || after === column.length) return null;
  return x - time[before] <= time[after] - x ? before : after;
}
