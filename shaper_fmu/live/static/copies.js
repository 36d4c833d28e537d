/* The state as other programs take it. */

"use strict";

const KLIPPER = { zv: "zv", mzv: "mzv", zvd: "zvd", ei: "ei", two_hump_ei: "2hump_ei", three_hump_ei: "3hump_ei" };

const COPIES = {
  python: ["Python", asPython],
  command: ["command line", asCommand],
  ssv: [".ssv (SSP parameter set)", asParameterSet],
  csv: ["machine: impulses as CSV", asImpulses],
  klipper: ["machine: Klipper", asKlipper],
};

function asPython(state, result) {
  const list = (values) => `[${values.join(", ")}]`;
  const kind = state.command.startsWith(PULSES) ? "pulses" : state.command === "step" ? "" : "profile";
  const lines = ["from shaper_fmu.design.shapers import shaper"];
  if (kind) lines.unshift(`from shaper_fmu.design.${kind === "pulses" ? "pulses" : "profiles"} import ${kind}`);
  lines.push("");
  const modes = `${list(state.frequency)}, ${list(state.damping)}`;
  lines.push(`sequence = shaper("${state.shaper}", ${modes}, vibration_tolerance=${state.tolerance})`);
  const [w, zeta] = [state.frequency[0], state.damping[0]];
  if (state.command.startsWith(PULSES)) {
    const timed = result.page.timed.includes(state.command.slice(PULSES.length)) ? `duration=${state.duration}, ` : "";
    lines.push(`command = pulses("${state.command.slice(PULSES.length)}", ${w}, ${zeta}, ${timed}frequency_ratio=${state.carrier})`);
  } else if (state.command !== "step") {
    const others = ["second", "third"].flatMap((which, i) =>
      state.command === "s_curve_modes" && state.frequency.length > i + 1
        ? [`${which}_natural_frequency=${state.frequency[i + 1]}`, `${which}_damping_ratio=${state.damping[i + 1]}`]
        : [],
    );
    const values = [`"${state.command}"`, state.size, state.duration, w, zeta, ...others];
    lines.push(`command = profile(${values.join(", ")})`);
  }
  lines.push(`print(sequence.duration, sequence.insensitivity(${w}, ${zeta}, ${state.tolerance}))`);
  return `${lines.join("\n")}\n`;
}

function asCommand(state) {
  const modes = state.frequency.flatMap((w, i) => [`-w ${w}`, `-z ${state.damping[i]}`]).join(" ");
  const lines = [`shaper-fmu design ${state.shaper} ${modes} --tolerance ${state.tolerance}`];
  const first = `-w ${state.frequency[0]} -z ${state.damping[0]}`;
  if (state.command.startsWith(PULSES)) {
    const kind = state.command.slice(PULSES.length);
    lines.push(`shaper-fmu design ${kind} ${first} --duration ${state.duration} --frequency-ratio ${state.carrier}`);
  } else if (state.command !== "step") {
    const all = state.command === "s_curve_modes" ? modes : first;
    lines.push(`shaper-fmu design ${state.command} ${all} --distance ${state.size} --duration ${state.duration}`);
  }
  return `${lines.join("\n")}\n`;
}

/* For the component InputShaper, to be bound to it in an SSP system. */
function asParameterSet(state) {
  const parameters = [
    ["shaper", "Enumeration", state.shaper],
    ["modes", "Integer", state.frequency.length],
    ...state.frequency.map((w, i) => [`natural_frequency[${i + 1}]`, "Real", w]),
    ...state.damping.map((zeta, i) => [`damping_ratio[${i + 1}]`, "Real", zeta]),
    ["vibration_tolerance", "Real", state.tolerance],
  ];
  const rows = parameters.map(([name, kind, value]) => `    <ssv:Parameter name="${name}"><ssv:${kind} value="${value}"/></ssv:Parameter>`);
  const space = "http://ssp-standard.org/SSP1/SystemStructureParameterValues";
  return [
    '<?xml version="1.0" encoding="UTF-8"?>',
    `<ssv:ParameterSet xmlns:ssv="${space}" version="1.0" name="live">`,
    "  <ssv:Parameters>",
    ...rows,
    "  </ssv:Parameters>",
    "</ssv:ParameterSet>",
    "",
  ].join("\n");
}

function asImpulses(state, result) {
  const rows = result.design.delay.map((delay, i) => `${delay},${result.design.amplitude[i]}`);
  return ["delay [s],amplitude", ...rows, ""].join("\n");
}

function asKlipper(state) {
  const kind = KLIPPER[state.shaper];
  if (!kind) return `# Klipper has no shaper ${state.shaper}; it has ${Object.keys(KLIPPER).join(", ")}.\n`;
  const more = state.frequency.length > 1 ? ["# For the first mode alone: Klipper shapes one mode of an axis."] : [];
  if (state.shaper.includes("ei") && state.tolerance !== 0.05) more.push("# Klipper's EI shapers are for a tolerance of 5 %.");
  const hertz = Number((state.frequency[0] / (2 * Math.PI)).toPrecision(7));
  return [
    ...more,
    "# Klipper designs its impulses by formulas of its own; `shaper-fmu tune --machine klipper` proves what they leave.",
    "[input_shaper]",
    `shaper_type_x: ${kind}`,
    `shaper_freq_x: ${hertz}`,
    `damping_ratio_x: ${state.damping[0]}`,
    "",
  ].join("\n");
}

if (typeof module !== "undefined") module.exports = { COPIES };
