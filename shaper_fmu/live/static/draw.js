/* Numbers and charts of a result. */

"use strict";

const percent = (x) => (x < 5e-15 ? "0 %" : `${chartNumber(Number((100 * x).toPrecision(4)))} %`);

function showNumbers(list, state, result, page) {
  const { design, times, left, curves, truth } = result;
  const period = (2 * Math.PI) / (state.frequency[0] * Math.sqrt(1 - state.damping[0] ** 2));
  const worst = (values) => (values.length ? Math.max(...values) : null);
  const output = result.plant.outputs[state.output] ?? result.plant.outputs[0];
  const floor = distanceToFloor(state, design, curves.widths, page.floor);
  const numbers = [
    ["delay", "delay of the shaper", design.duration, `${chartNumber(design.duration)} s`, `${chartNumber(design.duration / period)} damped periods`],
    ["residual", "V on the plant's modes", worst(curves.true), truth.length ? percent(worst(curves.true)) : "–", truth.length ? "at the command's end" : "not told by this plant"],
    ["remains", "remains in the response", left.shaped, `${chartNumber(Number(left.shaped.toPrecision(4)))} ${output.unit}`, remainsOf(left)],
    ["insensitivity", "insensitivity", design.insensitivity, chartNumber(design.insensitivity), `width of w/wn with V ≤ ${percent(state.tolerance)}`],
    ["believed", "V on believed modes", worst(curves.believed), percent(worst(curves.believed)), "the largest", true],
    ["floor", "above the floor", floor.value, floor.text, floor.why, true],
    ["end", "the command ends", times.end, `${chartNumber(times.end)} s`, `${design.count} impulse${design.count > 1 ? "s" : ""}`, true],
    ["certificate", "certificate", design.certificate, design.certificate.toExponential(1), "of the design's equations", true],
  ];
  if (list.children.length !== numbers.length) {
    list.replaceChildren(...numbers.map(() => Object.assign(document.createElement("div"), { innerHTML: "<dt></dt><dd></dd><small></small>" })));
  }
  numbers.forEach(([key, title, value, text, more, further], i) => {
    const tile = list.children[i];
    const [dt, dd, small] = tile.children;
    [tile.id, tile.className, dt.textContent, dd.textContent, small.textContent] = [`number-${key}`, further ? "further" : "", title, text, more];
    dd.dataset.value = value;
  });
}

function remainsOf({ shaped, unshaped }) {
  return unshaped > 0 ? `${percent(shaped / unshaped)} of unshaped` : "";
}

/* Duration over the floor's, less 1. A shaper for several modes is one for each of them, so that it is at least as long as the longest
   of their floors: then the distance is at most that from this one. */
function distanceToFloor(state, design, widths, table) {
  const no = (why) => ({ value: null, text: "–", why });
  if (state.shaper === "none") return no("no shaper");
  if (design.amplitude.some((a) => a < 0)) return no("negative impulses may be shorter");
  if (widths.every((width) => width === 0)) return no("V is above the tolerance");
  const floors = widths.map((width, i) => (width > 0 ? (floorOf(state.tolerance, width, table) * 2 * Math.PI) / state.frequency[i] : 0));
  const known = floors.filter((floor) => floor > 0); // none where the table ends before
  if (!known.length) return no("the table ends before");
  const longest = Math.max(...known);
  const value = design.duration / longest - 1;
  const text = percent(Math.max(0, value));
  if (widths.length > 1) return { value, text: `at most ${text}`, why: `by the floor of mode ${floors.indexOf(longest) + 1} alone` };
  return { value, text, why: state.damping[0] > 0 ? "about; the floor is undamped" : "about" };
}

/* The floor in undamped periods, by linear interpolation of a table over tolerance and insensitivity; NaN outside of it. */
function floorOf(tolerance, width, { tolerances, insensitivities, durations }) {
  const place = (x, grid) => {
    const k = x === grid.at(-1) ? grid.length - 2 : Math.max(0, grid.findIndex((one) => one > x) - 1);
    return x >= grid[0] && x <= grid.at(-1) ? [k, (x - grid[k]) / (grid[k + 1] - grid[k])] : [NaN, NaN];
  };
  const [[i, a], [j, b]] = [place(tolerance, tolerances), place(width, insensitivities)];
  if (Number.isNaN(i + j)) return NaN;
  const at = (r) => durations[r][j] + b * (durations[r][j + 1] - durations[r][j]);
  return at(i) + a * (at(i + 1) - at(i));
}

function drawCharts(charts, state, result) {
  const { design, curves, times, truth, shaped, unshaped, plant } = result;
  const output = plant.outputs[state.output] ?? plant.outputs[0];
  charts.impulses.draw(design.delay, [design.amplitude]);
  const believed = state.frequency.map((w, i) => [w, state.frequency.length > 1 ? `believed ${i + 1}` : "believed"]);
  const true_ = truth.map(([w], i) => [w, truth.length > 1 ? `true ${i + 1}` : "true", true]);
  charts.sensitivity.draw(curves.frequency, [curves.shaper, curves.whole], {
    levels: [[state.tolerance, percent(state.tolerance)]],
    marks: [...believed, ...true_],
    bands: bandsOf(curves, state),
  });
  const ends = [[times.sourceEnd, "unshaped command ends"], [times.end, "ends", true]].filter(([t]) => t > 0);
  charts.command.draw(shaped.time, [shaped.command, unshaped.command], { marks: ends.slice(-1) });
  const span = (low, high) => (low === high ? [] : [[low, high]]);
  charts.response.draw(shaped.time, [shaped.response, unshaped.response], { marks: [[times.end, "command ends", true]], bands: span(times.end, times.stop) });
  charts.response.label(output.unit ? `${output.label} [${output.unit}]` : output.label);
  charts.command.label(state.command === "step" || plant.signal === "position" ? "command" : `command: ${plant.signal}`);
}

/* Where the whole command is within the tolerance around each believed mode, between the curve's points by straight lines. */
function bandsOf({ frequency, whole }, { tolerance, frequency: modes }) {
  const found = [];
  const edge = (i, k) => frequency[i] + ((frequency[k] - frequency[i]) * (tolerance - whole[i])) / (whole[k] - whole[i]);
  for (const w of modes) {
    const at = frequency.findIndex((one) => one >= w);
    if (at < 0 || whole[at] > tolerance) continue;
    let [i, k] = [at, at];
    while (i > 0 && whole[i - 1] <= tolerance) i--;
    while (k < whole.length - 1 && whole[k + 1] <= tolerance) k++;
    const band = [i > 0 ? edge(i - 1, i) : frequency[0], k < whole.length - 1 ? edge(k, k + 1) : frequency.at(-1)];
    if (!found.some(([low]) => low === band[0])) found.push(band);
  }
  return found;
}
