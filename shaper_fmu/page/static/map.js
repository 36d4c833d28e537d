/* Maps of a page: values over two axes as colours with contour lines, one scale for all panels. Each panel is a chart of uPlot
   without curves: dragging zooms all of them, a double click or Escape shows all, pointer, finger and arrow keys show values below.

     new HeatMap(element, { title, x: "w/wn", y: "damping", value: "V [%]", xs, ys, panels: [[name, values]], columns, low, high,
       more: whether there are values beyond `high`, levels: [[5, "5 %"]], points: [[x, y]] });

   `xs` and `ys` rise; `values` has a row for each of `ys`, with null where there is none. */

"use strict";

/* Cividis (Nunez, Anderton, Renslow 2018): even steps of brightness, the same for those who do not see red and green apart. */
const CIVIDIS = ["#00224e", "#083370", "#35456c", "#4f576c", "#666970", "#7d7c78", "#948e77", "#aea371", "#c8b866", "#e5cf52", "#fee838"].map((hex) =>
  [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16)),
);
const MAP_HEIGHT = 290;

/* Red, green and blue for a share of the scale. */
function mapColour(share) {
  const at = Math.min(1, Math.max(0, share)) * (CIVIDIS.length - 1);
  const k = Math.min(CIVIDIS.length - 2, Math.floor(at));
  return CIVIDIS[k].map((one, i) => Math.round(one + (at - k) * (CIVIDIS[k + 1][i] - one)));
}

/* The cell of a rising grid that holds a value, and where in it; null outside. */
function mapCell(grid, value) {
  if (!(value >= grid[0] && value <= grid.at(-1))) return null;
  let [low, high] = [0, grid.length - 1];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (grid[middle] <= value) low = middle;
    else high = middle;
  }
  return [low, high === low ? 0 : (value - grid[low]) / (grid[high] - grid[low])];
}

/* The value at a place, linear in each direction between the grid's; null where one of them is missing. */
function mapValue(values, [i, a], [j, b]) {
  const [below, above] = [values[j], values[Math.min(j + 1, values.length - 1)]];
  const k = Math.min(i + 1, below.length - 1);
  const around = [below[i], below[k], above[i], above[k]];
  const weights = [(1 - a) * (1 - b), a * (1 - b), (1 - a) * b, a * b];
  let sum = 0;
  for (let n = 0; n < 4; n++) {
    if (weights[n] === 0) continue;
    if (around[n] === null) return null;
    sum += weights[n] * around[n];
  }
  return sum;
}

/* Where a level crosses the grid's cells, as pieces [x1, y1, x2, y2]. */
function mapContour(xs, ys, values, level) {
  const found = [];
  for (let j = 0; j + 1 < ys.length; j++) {
    for (let i = 0; i + 1 < xs.length; i++) {
      const corners = [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]]; // prettier-ignore
      const levels = corners.map(([p, q]) => values[q][p]);
      if (levels.includes(null)) continue;
      const crossed = [];
      for (let n = 0; n < 4; n++) {
        const m = (n + 1) % 4;
        if (levels[n] > level === levels[m] > level) continue;
        const share = (level - levels[n]) / (levels[m] - levels[n]);
        const [[p, q], [r, s]] = [corners[n], corners[m]];
        crossed.push([xs[p] + share * (xs[r] - xs[p]), ys[q] + share * (ys[s] - ys[q])]);
      }
      for (let n = 0; n + 1 < crossed.length; n += 2) found.push([...crossed[n], ...crossed[n + 1]]);
    }
  }
  return found;
}

class HeatMap extends Downloads {
  constructor(element, options) {
    super(element, options);
    this.element.classList.add("map");
    this.zoomed = false;
    this.grid = document.createElement("div");
    this.grid.className = "map-panels";
    this.grid.style.setProperty("--columns", options.columns);
    this.said = Object.assign(document.createElement("p"), { className: "map-said" });
    this.said.setAttribute("role", "status");
    this.scale = Object.assign(document.createElement("canvas"), { className: "map-scale" });
    this.element.append(this.grid, this.scale, this.said);
    this.plots = options.panels.map(([name, values]) => this.panel(name, values));
    this.drawScale();
    this.say();
    this.addDownloads();
    this.watch();
  }

  panel(name, values) {
    const { options } = this;
    const figure = document.createElement("div");
    figure.append(Object.assign(document.createElement("h4"), { textContent: name }));
    this.grid.append(figure);
    const contours = options.levels.map(([level, text]) => [mapContour(options.xs, options.ys, values, level), text]);
    const ends = (grid) => (u, low, high) => (this.zoomed ? [low, high] : [grid[0], grid.at(-1)]);
    const plain = { grid: { show: false } };
    const plot = new uPlot(
      {
        width: Math.max(figure.clientWidth, 120),
        height: MAP_HEIGHT,
        scales: { x: { time: false, range: ends(options.xs) }, y: { range: ends(options.ys) } },
        axes: [chartAxis({ label: options.x, size: 32, ...plain }), chartAxis({ label: options.y, size: 52, ...plain })],
        series: [{}, { paths: () => null, points: { show: false } }],
        legend: { show: false },
        cursor: { drag: { x: true, y: true, dist: 5, uni: 40 }, points: { show: false } },
        hooks: {
          drawClear: [(u) => this.drawValues(u, values)],
          draw: [(u) => this.drawLines(u, contours)],
          setCursor: [(u) => this.say(u, name, values)],
          setSelect: [(u) => u.select.width > 0 && this.zoom(u)],
        },
      },
      [[options.xs[0], options.xs.at(-1)], [options.ys[0], options.ys.at(-1)]],
      figure,
    );
    this.makeReachable(plot, name);
    return plot;
  }

  /* The other panels show what was marked in one, which uPlot does for that one. */
  zoom(from) {
    this.zoomed = true;
    const { left, top, width, height } = from.select;
    const [x, y] = [[left, left + width], [top + height, top]]; // prettier-ignore
    const ends = { x: x.map((at) => from.posToVal(at, "x")), y: y.map((at) => from.posToVal(at, "y")) };
    for (const plot of this.plots) {
      if (plot === from) continue;
      plot.batch(() => Object.entries(ends).forEach(([key, [min, max]]) => plot.setScale(key, { min, max })));
    }
  }

  showAll() {
    this.zoomed = false;
    for (const plot of this.plots) plot.setData(plot.data, true);
  }

  redraw() {
    for (const plot of this.plots) plot.redraw(false);
    this.drawScale();
  }

  fit(width) {
    if (width <= 0) return;
    for (const plot of this.plots) {
      const wanted = plot.root.parentElement.clientWidth;
      if (wanted > 0 && wanted !== plot.width) plot.setSize({ width: wanted, height: MAP_HEIGHT });
    }
    this.drawScale();
  }

  makeReachable(plot, name) {
    const { over } = plot;
    over.tabIndex = 0;
    over.setAttribute("role", "img");
    over.setAttribute("aria-label", `${this.options.title}${name ? `, ${name}` : ""}. Arrow keys show values, Escape shows all.`);
    over.style.touchAction = "pan-y";
    over.addEventListener("dblclick", () => this.showAll());
    over.addEventListener("pointermove", (event) => {
      if (event.pointerType !== "touch") return;
      const place = over.getBoundingClientRect();
      plot.setCursor({ left: event.clientX - place.left, top: event.clientY - place.top });
    });
    over.addEventListener("keydown", (event) => {
      if (event.key === "Escape") this.showAll();
      const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
      if (!step) return;
      event.preventDefault();
      const [width, height] = [over.clientWidth, over.clientHeight];
      const { left, top } = plot.cursor.left >= 0 ? plot.cursor : { left: 0.5 * width, top: 0.5 * height };
      const kept = (at, most) => Math.min(most, Math.max(0, at));
      plot.setCursor({ left: kept(left + 0.025 * width * step[0], width), top: kept(top + 0.025 * height * step[1], height) });
    });
  }

  drawValues({ ctx, bbox, posToVal }, values) {
    const [width, height] = [Math.round(bbox.width), Math.round(bbox.height)];
    if (width < 1 || height < 1) return;
    const { xs, ys, low, high } = this.options;
    const columns = Array.from({ length: width }, (_, k) => mapCell(xs, posToVal(bbox.left + k + 0.5, "x", true)));
    const image = new ImageData(width, height);
    for (let row = 0; row < height; row++) {
      const at = mapCell(ys, posToVal(bbox.top + row + 0.5, "y", true));
      for (let k = 0; at && k < width; k++) {
        const value = columns[k] ? mapValue(values, columns[k], at) : null;
        if (value === null) continue;
        image.data.set([...mapColour((value - low) / (high - low || 1)), 255], 4 * (row * width + k));
      }
    }
    ctx.putImageData(image, Math.round(bbox.left), Math.round(bbox.top));
  }

  drawLines({ ctx, bbox, valToPos }, contours) {
    const ratio = devicePixelRatio;
    const [px, py] = [(x) => valToPos(x, "x", true), (y) => valToPos(y, "y", true)];
    const twice = (path, width) => {
      for (const [colour, more] of [["rgba(0, 0, 0, 0.75)", 2], ["#fff", 0]]) { // prettier-ignore
        [ctx.strokeStyle, ctx.lineWidth] = [colour, (width + more) * ratio];
        ctx.stroke(path);
      }
    };
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    ctx.font = `600 ${11 * ratio}px system-ui, sans-serif`;
    ctx.textAlign = "center";
    contours.forEach(([pieces, text], k) => {
      const path = new Path2D();
      for (const [x1, y1, x2, y2] of pieces) {
        path.moveTo(px(x1), py(y1));
        path.lineTo(px(x2), py(y2));
      }
      twice(path, k ? 1.2 : 2.6);
      const middle = pieces.filter(([x, y]) => px(x) > bbox.left && px(x) < bbox.left + bbox.width && py(y) > bbox.top && py(y) < bbox.top + bbox.height);
      if (!middle.length) return;
      const [x, y] = middle[Math.floor((middle.length * (k + 1)) / (contours.length + 1))]; // not all at one height
      const half = 0.5 * ctx.measureText(text).width + 3 * ratio;
      const at = [Math.min(bbox.left + bbox.width - half, Math.max(bbox.left + half, px(x))), Math.max(bbox.top + 12 * ratio, py(y) - 4 * ratio)];
      [ctx.strokeStyle, ctx.lineWidth, ctx.fillStyle] = ["rgba(0, 0, 0, 0.8)", 3 * ratio, "#fff"];
      ctx.strokeText(text, ...at);
      ctx.fillText(text, ...at);
    });
    for (const [x, y] of this.options.points) {
      const path = new Path2D();
      path.moveTo(px(x) - 6 * ratio, py(y));
      path.lineTo(px(x) + 6 * ratio, py(y));
      path.moveTo(px(x), py(y) - 6 * ratio);
      path.lineTo(px(x), py(y) + 6 * ratio);
      twice(path, 2);
    }
    ctx.restore();
  }

  /* The colours' scale, with its ends and its middle. */
  drawScale() {
    const { low, high, more, value } = this.options;
    const ratio = devicePixelRatio;
    const width = Math.min(420, this.element.clientWidth || 420);
    [this.scale.width, this.scale.height] = [width * ratio, 44 * ratio];
    [this.scale.style.width, this.scale.style.height] = [`${width}px`, "44px"];
    this.scale.setAttribute("role", "img");
    this.scale.setAttribute("aria-label", `${value}: from ${chartNumber(low)} (dark) to ${chartNumber(high)} (light)`);
    const ctx = this.scale.getContext("2d");
    ctx.scale(ratio, ratio);
    const [left, wide] = [8, width - 40];
    for (let k = 0; k < wide; k++) {
      ctx.fillStyle = `rgb(${mapColour(k / (wide - 1)).join(",")})`;
      ctx.fillRect(left + k, 16, 1, 12);
    }
    ctx.fillStyle = chartInk(0.85);
    ctx.font = "12px system-ui, sans-serif";
    ctx.fillText(value, left, 11, wide);
    for (const share of [0, 0.25, 0.5, 0.75, 1]) {
      ctx.textAlign = share === 0 ? "left" : "center";
      ctx.fillText(`${share === 1 && more ? "≥ " : ""}${chartNumber(Number((low + share * (high - low)).toPrecision(3)))}`, left + share * wide, 41);
    }
  }

  /* The values under the pointer. */
  say(plot, name, values) {
    const { options } = this;
    const lines = options.levels.map(([, text], k) => `${text}${k === 0 && options.levels.length > 1 ? " (thick)" : ""}`).join(", ");
    let words = lines ? `White lines: ${lines}. ` : "";
    if (options.points.length) words += "Cross: the marked point. ";
    if (plot && plot.cursor.left >= 0) {
      const [x, y] = [plot.posToVal(plot.cursor.left, "x"), plot.posToVal(plot.cursor.top, "y")];
      const [column, row] = [mapCell(options.xs, x), mapCell(options.ys, y)];
      const value = column && row ? mapValue(values, column, row) : null;
      words = `${name ? `${name}: ` : ""}${options.x} ${chartNumber(x)}, ${options.y} ${chartNumber(y)}: ${options.value} ${chartNumber(value)}`;
    }
    this.said.textContent = words || " ";
  }

  /* All panels with their names, and the scale. */
  picture() {
    const canvases = this.plots.map((plot) => plot.ctx.canvas);
    const [wide, high] = [Math.max(...canvases.map((one) => one.width)), 20 * devicePixelRatio + Math.max(...canvases.map((one) => one.height))];
    const { columns, panels } = this.options;
    const rows = Math.ceil(panels.length / columns);
    const { drawn, ctx, top, ratio } = this.paper(Math.max(columns * wide, this.scale.width), rows * high + this.scale.height);
    canvases.forEach((canvas, k) => {
      const [x, y] = [(k % columns) * wide, top + Math.floor(k / columns) * high];
      ctx.fillText(panels[k][0], x + 50 * ratio, y + 13 * ratio, wide - 50 * ratio);
      ctx.drawImage(canvas, x, y + 20 * ratio);
    });
    ctx.drawImage(this.scale, 0, top + rows * high);
    return drawn;
  }

  /* A row for each place, with the values of all panels. */
  rows() {
    const { x, y, value, xs, ys, panels } = this.options;
    const head = [x, y, ...panels.map(([name]) => (name ? `${value}, ${name}` : value))];
    return [head, ...ys.flatMap((b, j) => xs.map((a, i) => [a, b, ...panels.map(([, values]) => values[j][i])]))];
  }
}
