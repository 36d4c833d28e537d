/* The page: controls change the state, the state is computed and drawn. */

"use strict";

class LivePage {
  constructor(page, studio) {
    [this.page, this.studio] = [page, studio];
    this.took = []; // milliseconds from an input's event until everything was drawn
    this.charts = this.makeCharts();
    const { state, wrong } = stateOf(location.hash, page);
    this.state = state;
    this.makeBar();
    this.makeControls();
    this.redraw();
    if (wrong.length) this.say(`Not understood in the link, so left as at the start: ${wrong.join(", ")}`);
    addEventListener("hashchange", () => {
      if (location.hash.slice(1) !== hashOf(this.state)) this.take(stateOf(location.hash, page));
    });
  }

  by(id) {
    return document.getElementById(id);
  }

  say(words) {
    this.by("said").textContent = words;
  }

  take({ state, wrong }) {
    this.state = state;
    this.makeControls();
    this.redraw();
    this.say(wrong.length ? `Not understood in the link, so left as at the start: ${wrong.join(", ")}` : "");
  }

  makeBar() {
    const presets = this.by("presets");
    this.page.presets.forEach((preset, i) => presets.append(new Option(preset.title, i)));
    const note = this.by("preset-note");
    presets.onchange = () => {
      const preset = this.page.presets[presets.value];
      note.hidden = !preset;
      if (!preset) return;
      note.textContent = preset.note;
      const start = startState(this.page, preset.state.plant);
      this.take({ state: { ...start, ...structuredClone(preset.state) }, wrong: [] });
    };
    this.by("reset").onclick = () => {
      [presets.value, note.hidden] = ["", true];
      this.take({ state: startState(this.page), wrong: [] });
    };
    this.copies = copiesOf(this.page);
    choice(this.by("copy-as"), Object.entries(this.copies).map(([key, [title]]) => [key, title]), "python", () => this.showCopy());
    this.by("copy-box").ontoggle = () => this.showCopy();
    this.by("copy").onclick = () => this.copy(this.copyText(), "Copied");
    this.by("link").hidden = location.protocol === "about:";
    this.by("link").onclick = () => {
      this.keepHash();
      this.copy(location.href, "Link copied");
    };
    this.by("believe").onclick = () => {
      const modes = this.result.truth.slice(0, MOST_MODES);
      const clamped = (x, [low, high]) => Math.min(high, Math.max(low, x));
      this.state.frequency = modes.map(([w]) => clamped(Number(w.toPrecision(6)), LIMITS.frequency));
      this.state.damping = modes.map(([, zeta]) => clamped(Number(zeta.toPrecision(6)), LIMITS.damping));
      this.makeControls();
      this.redraw();
    };
  }

  copyText() {
    return this.result ? this.copies[this.by("copy-as").value][1](this.state, { ...this.result, page: this.page }) : "";
  }

  showCopy() {
    if (this.by("copy-box").open) this.by("copy-text").value = this.copyText();
  }

  async copy(text, words) {
    try {
      await navigator.clipboard.writeText(text);
      this.say(`${words}.`);
    } catch {
      this.by("copy-box").open = true;
      this.by("copy-text").value = text;
      this.by("copy-text").select();
      this.say("The browser does not let the page copy: it is selected below, copy it from there.");
    }
  }

  /* All controls anew, for the state. */
  makeControls() {
    const { state, page } = this;
    choice(this.by("command"), page.commands, state.command, (value) => this.change({ command: value }, true));
    choice(this.by("shaper"), page.shapers, state.shaper, (value) => this.change({ shaper: value }, true));
    const plants = Object.entries(page.plants).map(([name, plant]) => [name, plant.title]);
    choice(this.by("plant"), plants, state.plant, (name) => {
      const { parameters } = startState(page, name);
      this.change({ plant: name, output: 0, parameters }, true);
    });
    const plant = page.plants[state.plant];
    const outputs = plant.outputs.map(({ label, unit }, i) => [String(i), unit ? `${label} [${unit}]` : label]);
    choice(this.by("output"), outputs, String(state.output), (value) => this.change({ output: Number(value) }));
    this.by("modes").value = state.frequency.length;
    this.by("modes").onchange = () => this.changeModes(Number(this.by("modes").value));
    this.makeSliders();
    this.by("plant-note").textContent = plant.note;
    this.by("believe").disabled = !plant.modes;
  }

  makeSliders() {
    const { state, page } = this;
    const limited = (key, label, unit, more = {}) => ({ key, label, unit, low: LIMITS[key][0], high: LIMITS[key][1], log: true, ...more });
    const isTrain = state.command.startsWith(PULSES);
    const command = [limited("size", state.command === "step" || isTrain ? "height" : "distance", state.command === "step" || isTrain ? "" : "m")];
    if (state.command !== "step") command.push(limited("duration", "duration", "s"));
    if (isTrain) command.push(limited("carrier", "carrier's frequency over the damped one", "", { log: false }));
    const set = (told, x) => this.change({ [told.key]: x });
    sliders(this.by("command-sliders"), command, (told) => state[told.key], set);
    sliders(this.by("tolerance-slider"), [limited("tolerance", "tolerated residual vibration V", "")], () => state.tolerance, set);
    const further = ownOf(state, page).map((told) => ({ ...told, key: told.name, unit: "" }));
    sliders(this.by("shaper-sliders"), further, ({ value }) => value, ({ name }, x) => this.change({ own: { ...this.state.own, [name]: x } }));
    const modes = state.frequency.flatMap((_, i) => [
      { ...limited("frequency", `natural frequency ${i + 1}`, "rad/s"), name: "frequency", i },
      { ...limited("damping", `damping ratio ${i + 1}`, "", { log: false }), name: "damping", i },
    ]);
    const keyed = modes.map((told) => ({ ...told, key: `${told.name}-${told.i + 1}` }));
    sliders(this.by("mode-sliders"), keyed, ({ name, i }) => state[name][i], ({ name, i }, x) => this.change({ [name]: state[name].with(i, x) }));
    const own = page.plants[state.plant].sliders.map((told, i) => ({ ...told, key: `plant-${i}`, i }));
    sliders(this.by("plant-sliders"), own, ({ i }) => state.parameters[i], ({ i }, x) => this.change({ parameters: state.parameters.with(i, x) }));
  }

  changeModes(count) {
    const { frequency, damping } = this.state;
    while (frequency.length < count) {
      const [w, zeta] = this.result?.truth[frequency.length] ?? [2 * frequency.at(-1), damping.at(-1)];
      frequency.push(Math.min(LIMITS.frequency[1], Number(w.toPrecision(6))));
      damping.push(Math.min(LIMITS.damping[1], Number(zeta.toPrecision(6))));
    }
    this.change({ frequency: frequency.slice(0, count), damping: damping.slice(0, count) }, true);
  }

  change(values, controls = false) {
    const since = globalThis.event?.timeStamp ?? performance.now();
    this.state = { ...this.state, ...values };
    if (controls) this.makeControls();
    this.redraw();
    queueMicrotask(() => queueMicrotask(() => this.took.push(performance.now() - since))); // charts are drawn in microtasks
  }

  redraw() {
    const problem = this.by("problem");
    try {
      this.result = this.studio.computed(this.state);
      problem.hidden = true;
      document.body.classList.remove("stale");
    } catch (error) {
      if (!(error instanceof KernelError)) throw error;
      this.result = null;
      problem.hidden = false;
      problem.textContent = `${error.message}. What is shown is of before.`;
      document.body.classList.add("stale");
    }
    if (this.result) this.show(this.result);
    clearTimeout(this.keeping);
    this.keeping = setTimeout(() => this.keepHash(), 300);
    this.showCopy();
  }

  keepHash() {
    if (location.protocol !== "about:") history.replaceState(null, "", `#${hashOf(this.state)}`); // inside a report it has no address
  }

  makeCharts() {
    const share = { range: (low, high) => [0, Math.min(1.6, Math.max(0.12, 1.06 * (high ?? 1)))] };
    const room = { xRange: (low, high) => [-0.03 * (high || 1), 1.05 * (high || 1)] };
    const height = matchMedia("(max-width: 56rem)").matches ? 190 : 260;
    const make = (key, options) => new Chart(this.by(`chart-${key}`), { height, ...options });
    return {
      impulses: make("impulses", { title: "impulses", x: "delay [s]", y: "amplitude", ...room, lines: [{ name: "impulse", stems: true }] }),
      sensitivity: make("sensitivity", {
        title: "sensitivity", x: "natural frequency [rad/s]", beside: HERTZ, y: "V", ...share,
        lines: [{ name: "shaper" }, { name: "whole command" }],
      }),
      command: make("command", { title: "command", x: "time [s]", y: "command", lines: [{ name: "shaped" }, { name: "unshaped" }] }),
      response: make("response", { title: "response", x: "time [s]", y: "response", lines: [{ name: "shaped" }, { name: "unshaped" }] }),
    };
  }

  show(result) {
    showNumbers(this.by("numbers"), this.state, result, this.page);
    drawCharts(this.charts, this.state, result);
    const words = result.truth.map(([w, zeta]) => `${chartNumber(w)} rad/s (${chartNumber(w * HERTZ[1])} Hz), damping ratio ${chartNumber(zeta)}`);
    this.by("truth").textContent = words.length ? `Its own modes: ${words.join("; ")}` : "";
  }
}
