/* The state as other programs take it. */

"use strict";

const COPIES = {
  python: ["Python", asPython],
  command: ["command line", asCommand],
  ssv: [".ssv (SSP parameter set)", asParameterSet],
  csv: ["machine: impulses as CSV", asImpulses],
};

/* All of them by key: [title, text of a state and its result]. */
function copiesOf(page) {
  const firmwares = page.firmwares.map((firmware) => [firmware.name, [`machine: ${firmware.title}`, (state) => asFirmware(state, firmware)]]);
  return { ...COPIES, ...Object.fromEntries(firmwares) };
}

function asPython(state, result) {
  const list = (values) => `[${values.join(", ")}]`;
  const kind = state.command.startsWith(PULSES) ? "pulses" : state.command === "step" ? "" : "profile";
  const lines = ["from shaper_fmu.design.shapers import shaper"];
  if (kind) lines.unshift(`from shaper_fmu.design.${kind === "pulses" ? "pulses" : "profiles"} import ${kind}`);
  lines.push("");
  const modes = `${list(state.frequency)}, ${list(state.damping)}`;
  const own = ownOf(state, result.page).map(({ name, value }) => `, ${name}=${value}`).join("");
  lines.push(`sequence = shaper("${state.shaper}", ${modes}, vibration_tolerance=${state.tolerance}${own})`);
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

function asCommand(state, result) {
  const modes = state.frequency.flatMap((w, i) => [`-w ${w}`, `-z ${state.damping[i]}`]).join(" ");
  const own = ownOf(state, result.page).map(({ name, value }) => ` --${name.replaceAll("_", "-")} ${value}`).join("");
  const lines = [`shaper-fmu design ${state.shaper} ${modes} --tolerance ${state.tolerance}${own}`];
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
function asParameterSet(state, result) {
  const parameters = [
    ["shaper", "Enumeration", state.shaper],
    ["modes", "Integer", state.frequency.length],
    ...state.frequency.map((w, i) => [`natural_frequency[${i + 1}]`, "Real", w]),
    ...state.damping.map((zeta, i) => [`damping_ratio[${i + 1}]`, "Real", zeta]),
    ["vibration_tolerance", "Real", state.tolerance],
    ...ownOf(state, result.page).map(({ name, value, whole }) => [name, whole ? "Integer" : "Real", value]),
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

/* A number as the firmware's own settings have it: so many digits, no exponent. */
function written(value, digits) {
  const rounded = Number(value.toPrecision(digits));
  return Number.isInteger(rounded) ? `${rounded}.0` : `${rounded}`;
}

/* The settings of a firmware for the first mode, and what they leave out. */
function asFirmware(state, firmware) {
  const said = (lines) => lines.map((line) => `${firmware.comment} ${line}\n`).join("");
  const shaper = firmware.shapers[state.shaper];
  if (!shaper) return said([`${firmware.title} has no shaper ${state.shaper}; it has ${Object.keys(firmware.shapers).join(", ")}.`]);
  const hertz = state.frequency[0] / (2 * Math.PI);
  const [lowest, highest] = firmware.frequencies;
  if (hertz < lowest || hertz > highest) return said([`${firmware.title} takes ${lowest} to ${highest} Hz, not ${written(hertz, 6)} Hz.`]);
  const damping = Number(Math.min(shaper.mostDamping, Math.max(firmware.leastDamping, state.damping[0])).toPrecision(4));
  const lines = [];
  const whose = firmware.oneForAll ? "all axes" : "one axis";
  if (state.frequency.length > 1) lines.push(`For the first mode alone: its shaper is for one mode of ${whose}.`);
  if (state.shaper.includes("ei") && state.tolerance !== 0.05) lines.push(`${firmware.title}'s EI shapers are for a tolerance of 5 %.`);
  if (damping !== Number(state.damping[0].toPrecision(4))) lines.push(`It does not take the damping ratio ${state.damping[0]}; the nearest is ${damping}.`);
  lines.push(`${firmware.title} designs its impulses by formulas of its own; \`shaper-fmu tune --for ${firmware.name}\` proves what they leave.`);
  const frequency = Number(hertz.toPrecision(6));
  const numbers = { frequency: written(hertz, 6), damping: written(damping, 4), damped: written(frequency * Math.sqrt(1 - damping * damping), 6) };
  return said(lines) + shaper.lines.replace(/\{(\w+)\}/g, (_, name) => numbers[name]) + said(firmware.how);
}

if (typeof module !== "undefined") module.exports = { copiesOf };
