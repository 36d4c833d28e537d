/* Designs and simulates what the state of the page asks for, by the kernels; nothing here computes a shaper, a profile or a plant.

   A step and pulses jump: steps of the simulation end at every jump, as a master of FMI ends them. A profile is held over each
   step, and the plant is given the shaped command's mean over it (`shaped_mean`). */

"use strict";

const STEPS = 2000;
const SUBSTEPS = 4; // of a loop with a controller, so that it acts without noticeable delay
const PULSES = "pulses:";

class Studio {
  /* From { kernels: { name: { module, layout } }, plants: {...} } with WebAssembly.Modules. */
  constructor(parts) {
    this.plants = parts.plants;
    this.parts = parts.kernels;
    this.loaded = {};
  }

  kernel(name) {
    return (this.loaded[name] ??= new Kernel(this.parts[name].module, this.parts[name].layout));
  }

  /* All that the page shows of a state. Throws KernelError for what is not possible. */
  computed(state) {
    const plant = this.plants[state.plant];
    const design = this.designed(state);
    const truth = this.trueModes(state, plant);
    const source = this.source(state, plant);
    const end = source.end + design.duration;
    const times = { end, sourceEnd: source.end, stop: this.horizon(state, truth, end) };
    const curves = this.curves(state, design, truth);
    const unshaped = this.unshaped(state, plant, source, times.stop);
    const shaped = state.shaper === "none" ? unshaped : this.run(state, plant, source, design.kernel, times.stop);
    const left = { shaped: remaining(shaped, end), unshaped: remaining(unshaped, source.end) };
    return { plant, design, truth, times, curves, unshaped, shaped, left };
  }

  /* The run without a shaper, which stays while the shaper alone changes. */
  unshaped(state, plant, source, stop) {
    const { command, size, duration, carrier, parameters, output } = state;
    const asked = command === "step" ? [] : [duration, carrier, state.frequency, state.damping];
    const key = JSON.stringify([state.plant, command, size, asked, parameters, output, stop]);
    if (key !== this.kept?.key) this.kept = { key, run: this.run(state, plant, source, null, stop) };
    return this.kept.run;
  }

  /* The shaper's impulses and figures of merit. */
  designed(state) {
    const kernel = this.kernel("InputShaper");
    kernel.reset();
    kernel.set("shaper", state.shaper);
    kernel.set("modes", state.frequency.length);
    kernel.set("natural_frequency", state.frequency);
    kernel.set("damping_ratio", state.damping);
    kernel.set("vibration_tolerance", state.tolerance);
    for (const [name, value] of Object.entries(state.own)) kernel.set(name, value);
    kernel.start(0);
    const count = kernel.get("impulses");
    return {
      kernel,
      count,
      amplitude: Array.from(kernel.real("amplitude").subarray(0, count)),
      delay: Array.from(kernel.real("delay").subarray(0, count)),
      duration: kernel.get("duration"),
      insensitivity: kernel.get("insensitivity"),
      certificate: kernel.get("certificate"),
    };
  }

  /* The plant with its true parameters, started. */
  plantKernel(state, plant) {
    const kernel = this.kernel(plant.component);
    kernel.reset();
    for (const [name, value] of Object.entries(plant.values)) kernel.set(name, value);
    plant.sliders.forEach((slider, i) => (kernel.real(slider.name)[slider.index] = state.parameters[i]));
    return kernel;
  }

  /* [frequency, damping ratio] of the plant's own modes, none where it does not tell them. */
  trueModes(state, plant) {
    if (!plant.modes) return [];
    const kernel = this.plantKernel(state, plant);
    kernel.start(0);
    const [frequency, damping] = ["natural_frequency", "damping_ratio"].map((name) =>
      name === "damping_ratio" && plant.component === "FlexibleBeam" ? kernel.real("modal_damping") : kernel.real(name),
    );
    const count = typeof plant.modes === "string" ? kernel.get(plant.modes) : plant.modes;
    return Array.from({ length: count }, (_, i) => [frequency[i], damping[i]]).filter(([w, zeta]) => w > 0 && zeta >= 0 && zeta < 1);
  }

  /* The command before it is shaped: its value at the start and after each step, its next jump [s], its end [s], whether it jumps. */
  source(state, plant) {
    if (state.command === "step") {
      return { start: () => state.size, advance: () => state.size, next: () => Infinity, end: 0, jumps: true };
    }
    const isTrain = state.command.startsWith(PULSES);
    const kernel = this.commandKernel(isTrain ? "PulseTrain" : "MotionProfile", state);
    const output = kernel.real(isTrain ? "pulse" : plant.signal);
    const next = kernel.real("next_event_time");
    const end = isTrain ? kernel.get("travel_time") : state.duration;
    return {
      start: () => (this.commandKernel(kernel.layout.component, state), output[0]),
      advance: (t, h) => (kernel.step(t, h), output[0]),
      next: () => next[0],
      end,
      jumps: isTrain,
    };
  }

  /* The component of the command, or of its residual vibration, started for the first mode that is believed. */
  commandKernel(name, state) {
    const kernel = this.kernel(name);
    kernel.reset();
    kernel.set("natural_frequency", state.frequency[0]);
    kernel.set("damping_ratio", state.damping[0]);
    kernel.set("duration", state.duration);
    if (state.command.startsWith(PULSES)) {
      kernel.set("design", state.command.slice(PULSES.length));
      kernel.set("amplitude", state.size);
      kernel.set("frequency_ratio", state.carrier);
    } else {
      kernel.set("profile", state.command);
      kernel.set("distance", state.size);
      ["second", "third"].forEach((which, i) => {
        if (!(`${which}_natural_frequency` in kernel.layout.variables)) return;
        kernel.set(`${which}_natural_frequency`, state.frequency[i + 1] ?? 0);
        kernel.set(`${which}_damping_ratio`, state.damping[i + 1] ?? 0);
      });
    }
    return kernel.start(0), kernel;
  }

  /* V over frequency, of the shaper and of the whole command; and on the believed and the true modes. */
  curves(state, design, truth) {
    const modes = [...state.frequency.map((w, i) => [w, state.damping[i]]), ...truth];
    const frequencies = modes.map(([w]) => w);
    const range = { lowest: 0.25 * Math.min(...frequencies), highest: 1.75 * Math.max(...frequencies) };
    const ask = (kernel) => {
      kernel.set("lowest", range.lowest);
      kernel.set("highest", range.highest);
      kernel.set("curve_damping", state.damping[0]);
      kernel.set("probes", modes.length);
      kernel.set("probe_frequency", frequencies);
      kernel.set("probe_damping", modes.map(([, zeta]) => zeta));
    };
    const asked = (kernel) => {
      kernel.set("asked", true);
      kernel.step(0, 0);
      return { curve: kernel.get("curve_vibration"), modes: kernel.get("probe_vibration").slice(0, modes.length) };
    };
    const kernel = this.kernel("ShaperCurve");
    kernel.reset();
    kernel.set("impulses", design.count);
    kernel.set("amplitude", design.amplitude);
    kernel.set("delay", design.delay);
    kernel.set("bands", state.frequency.length > 1 ? state.frequency.length : 0); // the shaper itself tells that of a single one
    kernel.set("tolerance", state.tolerance);
    ask(kernel);
    const shaper = asked(kernel);
    const widths = state.frequency.length > 1 ? kernel.get("probe_insensitivity").slice(0, state.frequency.length) : [design.insensitivity];
    const frequency = kernel.get("curve_frequency");
    let whole = shaper;
    if (state.command !== "step") {
      const command = this.commandKernel(state.command.startsWith(PULSES) ? "PulseCurve" : "MoveCurve", state);
      ask(command);
      const alone = asked(command);
      const product = (a, b) => a.map((one, i) => one * b[i]);
      whole = { curve: product(alone.curve, shaper.curve), modes: product(alone.modes, shaper.modes) };
    }
    const believed = state.frequency.length;
    return {
      frequency,
      widths,
      shaper: shaper.curve,
      whole: whole.curve,
      believed: whole.modes.slice(0, believed),
      true: whole.modes.slice(believed),
    };
  }

  /* What is shown [s]: the command and four of the slowest periods, rounded up to a number that does not change all the time. */
  horizon(state, truth, end) {
    const slowest = Math.min(...state.frequency, ...truth.map(([w]) => w));
    const wanted = end + (4 * 2 * Math.PI) / slowest;
    const unit = 10 ** Math.floor(Math.log10(wanted));
    return [1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10].find((one) => one * unit >= wanted * (1 - 1e-12)) * unit;
  }

  /* A simulation until `stop`; { time, command, response }, one value at each of the steps' ends. */
  run(state, plant, source, shaper, stop) {
    const h = stop / STEPS;
    const found = { time: new Float64Array(STEPS + 1), command: new Float64Array(STEPS + 1), response: new Float64Array(STEPS + 1) };
    const loop = this.loop(state, plant, source, shaper);
    const note = (k) => ([found.time[k], found.command[k], found.response[k]] = [k * h, loop.command(), loop.response()]);
    note(0);
    for (let k = 0; k < STEPS; k++) {
      (source.jumps ? loop.untilWithJumps : loop.held)(k * h, (k + 1) * h);
      note(k + 1);
    }
    return found;
  }

  /* Source, shaper and plant, started at 0 and coupled. */
  loop(state, plant, source, shaper) {
    let value = source.start();
    const names = ["command", "shaped", "shaped_mean", "next_event_time"];
    const [given, shaped, mean, next] = shaper ? names.map((name) => shaper.real(name)) : [[value], null, null, [Infinity]];
    given[0] = value;
    if (shaper) shaper.start(0);
    const command = () => (shaper ? shaped[0] : value);
    const driven = this.driven(state, plant, command());

    function pass(t, h) {
      const before = value;
      value = source.advance(t, h);
      if (shaper) shaper.step(t, h);
      if (value === before) return;
      given[0] = value;
      if (shaper) shaper.step(t + h, 0);
    }
    return {
      command,
      response: driven.response,
      untilWithJumps(begin, end) {
        let t = begin;
        const near = 1e-9 * (end - begin);
        while (t < end) {
          const jump = Math.min(source.next(), next[0]);
          const until = jump > t && jump < end - near ? jump : end;
          driven.advance(t, until - t, command());
          pass(t, until - t);
          t = until;
        }
      },
      held(begin, end) {
        const h = end - begin;
        if (shaper) shaper.step(begin, h);
        driven.advance(begin, h, shaper ? mean[0] : value);
        value = source.advance(begin, h);
        given[0] = value;
      },
    };
  }

  /* The plant, or controller and plant, under a command that is held over each step. */
  driven(state, plant, first) {
    const kernel = this.plantKernel(state, plant);
    const output = plant.outputs[state.output] ?? plant.outputs[0];
    const [input, shown] = [kernel.real(plant.input), kernel.real(output.name)];
    const gain = plant.gain ? kernel.real(plant.gain)[0] : 1;
    const response = () => shown[output.index];
    if (Object.keys(plant.controller).length === 0) {
      input[0] = gain * first;
      kernel.start(0);
      return { response, advance: (t, h, command) => ((input[0] = gain * command), kernel.step(t, h)) };
    }
    const controller = this.kernel("PositionController");
    controller.reset();
    for (const [name, value] of Object.entries(plant.controller)) controller.set(name, value);
    const [reference, position, velocity, force] = ["reference", "position", "velocity", "force"].map((name) => controller.real(name));
    const [places, speeds] = [kernel.real("position"), kernel.real("velocity")];
    controller.start(0);
    kernel.start(0);
    const once = (t, h, command) => {
      [reference[0], position[0], velocity[0]] = [command, places[0], speeds[0]];
      controller.step(t, h);
      input[0] = force[0];
      kernel.step(t, h);
    };
    return {
      response,
      advance(t, h, command) {
        for (let i = 0; i < SUBSTEPS; i++) once(t + (i * h) / SUBSTEPS, h / SUBSTEPS, command);
      },
    };
  }
}

/* What swings after a time: half of the difference between the largest and the smallest value. */
function remaining(run, since) {
  const first = Math.min(run.time.findIndex((t) => t >= since - 1e-12) >>> 0, run.time.length - 1);
  const after = run.response.subarray(first);
  return 0.5 * (after.reduce((a, b) => Math.max(a, b)) - after.reduce((a, b) => Math.min(a, b)));
}

if (typeof module !== "undefined") module.exports = { Studio, remaining };
