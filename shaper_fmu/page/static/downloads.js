/* What charts and maps have in common: colours, numbers, buttons to download the picture and the values, and print. */

"use strict";

const CHART_COLOURS = {
  light: ["#0072B2", "#D55E00", "#009E73", "#AA3377", "#8A6100", "#3489BD", "#000000"],
  dark: ["#56B4E9", "#FF8A3D", "#2FC79B", "#E58CBF", "#E6B020", "#9BD1F5", "#F2F2F2"],
};
const CHART_PAPER = { light: "#ffffff", dark: "#15181c" };
const CHART_PRINTED = 680; // width of an A4 page
let chartPrinting = false; // on white, whatever the screen has
addEventListener("beforeprint", () => (chartPrinting = true));
addEventListener("afterprint", () => (chartPrinting = false));

function chartIsDark() {
  if (chartPrinting) return false;
  return getComputedStyle(document.documentElement).colorScheme.includes("dark") && matchMedia("(prefers-color-scheme: dark)").matches;
}

function chartInk(share) {
  const grey = chartIsDark() ? 255 : 0;
  return `rgba(${grey}, ${grey}, ${grey}, ${share})`;
}

function chartNumber(value) {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  return String(Number(value.toPrecision(5))).replace("-", "−");
}

/* An axis of uPlot in these colours. */
function chartAxis(more) {
  return {
    stroke: () => chartInk(0.85),
    grid: { stroke: () => chartInk(0.12), width: 1 },
    ticks: { stroke: () => chartInk(0.25), width: 1, size: 5 },
    font: "12px system-ui, sans-serif",
    labelFont: "13px system-ui, sans-serif",
    labelSize: 20,
    values: (_, ticks) => ticks.map((one) => (one === null ? "" : chartNumber(one))),
    ...more,
  };
}

/* An element with `options.title`, which has a `picture()`, a canvas, and `rows()`, of a table. `fit(width)` lays it out. */
class Downloads {
  constructor(element, options) {
    this.element = element;
    this.options = options;
    this.element.classList.add("chart");
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

  /* Lays it out anew when its width, the colours or the medium change. */
  watch() {
    new ResizeObserver(() => chartPrinting || this.fit(this.element.clientWidth)).observe(this.element);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.redraw());
    addEventListener("beforeprint", () => {
      this.fit(Math.min(this.element.clientWidth, CHART_PRINTED));
      this.redraw();
    });
    addEventListener("afterprint", () => {
      this.fit(this.element.clientWidth);
      this.redraw();
    });
  }

  /* Paper of this size, with the title on it, to be drawn on below. */
  paper(width, height) {
    const ratio = devicePixelRatio;
    const drawn = document.createElement("canvas");
    const top = 26 * ratio;
    [drawn.width, drawn.height] = [width, height + top];
    const ctx = drawn.getContext("2d");
    ctx.fillStyle = CHART_PAPER[chartIsDark() ? "dark" : "light"];
    ctx.fillRect(0, 0, drawn.width, drawn.height);
    ctx.fillStyle = chartInk(0.9);
    ctx.font = `600 ${13 * ratio}px system-ui, sans-serif`;
    ctx.fillText(this.options.title ?? "", 10 * ratio, 17 * ratio, width - 20 * ratio);
    ctx.font = `${12 * ratio}px system-ui, sans-serif`;
    return { drawn, ctx, top, ratio };
  }

  savePicture() {
    this.picture().toBlob((blob) => this.save(blob, "png"));
  }

  saveTable() {
    const quoted = (cell) => (typeof cell === "string" ? `"${cell.replaceAll('"', '""')}"` : (cell ?? ""));
    const text = this.rows().map((row) => `${row.map(quoted).join(",")}\n`);
    this.save(new Blob(text, { type: "text/csv" }), "csv");
  }

  save(blob, ending) {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(blob);
    link.download = `${(this.options.title ?? "chart").replace(/[^\p{L}\p{N}]+/gu, "_")}.${ending}`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  }
}
