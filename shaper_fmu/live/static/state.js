/* The state of the page: what is chosen. It is kept in the page's address, after the #, so that a link holds it. */

"use strict";

const MOST_MODES = 4;
const LIMITS = {
  size: [0.001, 10],
  duration: [0.05, 20],
  carrier: [3, 40],
  tolerance: [0.005, 0.3],
  frequency: [0.3, 300],
  damping: [0, 0.5],
};

function startState(page, plant = page.firstPlant) {
  const usual = {
    command: "step",
    size: 1,
    duration: 1,
    carrier: 12,
    shaper: "zvd",
    tolerance: 0.05,
    own: {}, // a shaper's own parameters, by name, where they are not at their start values
    frequency: [10],
    damping: [0.05],
    plant,
    output: 0,
    parameters: page.plants[plant].sliders.map((slider) => slider.start),
  };
  return { ...usual, ...structuredClone(page.start) }; // of a page about one design
}

function hashOf(state) {
  const modes = state.frequency.map((w, i) => `${w},${state.damping[i]}`).join(";");
  const { command, size, duration, carrier, shaper, tolerance, plant, output } = state;
  const parameters = state.parameters.join(",");
  return new URLSearchParams({ command, size, duration, carrier, shaper, tolerance, ...state.own, modes, plant, output, parameters })
    .toString()
    .replaceAll("%2C", ",")
    .replaceAll("%3B", ";")
    .replaceAll("%3A", ":");
}

/* The parameters that a shaper of this kind has of its own, with their values. */
function ownOf(state, page) {
  return (page.shaperParameters[state.shaper] ?? []).map((told) => ({ ...told, value: state.own[told.name] ?? told.start }));
}

/* The state of a link, and what of it is not understood; that stays as at the start. */
function stateOf(hash, page) {
  const given = new URLSearchParams(hash.replace(/^#/, ""));
  const wrong = [];
  const known = page.plants[given.get("plant")] ? given.get("plant") : page.firstPlant;
  if (given.has("plant") && known !== given.get("plant")) wrong.push(`plant ${given.get("plant")}: this page does not have it`);
  const state = startState(page, known);
  const among = (name, values) => {
    if (!given.has(name)) return;
    if (values.includes(given.get(name))) state[name] = given.get(name);
    else wrong.push(`${name} ${given.get(name)}`);
  };
  const number = (text, [low, high]) => {
    const value = Number(text);
    return text.trim() !== "" && value >= low && value <= high ? value : null;
  };
  among("command", page.commands.flatMap((group) => group.items.map(([value]) => value)));
  among("shaper", page.shapers.map(([value]) => value));
  for (const name of ["size", "duration", "carrier", "tolerance"]) {
    if (!given.has(name)) continue;
    const value = number(given.get(name), LIMITS[name]);
    if (value === null) wrong.push(`${name} ${given.get(name)} (${LIMITS[name].join(" to ")})`);
    else state[name] = value;
  }
  for (const { name, low, high, whole } of Object.values(page.shaperParameters).flat()) {
    if (!given.has(name)) continue;
    const value = number(given.get(name), [low, high]);
    if (value === null || (whole && !Number.isInteger(value))) wrong.push(`${name} ${given.get(name)} (${low} to ${high})`);
    else state.own[name] = value;
  }
  if (given.has("modes")) {
    const pairs = given.get("modes").split(";").map((pair) => pair.split(","));
    const modes = pairs.map(([w, zeta]) => [number(w, LIMITS.frequency), number(zeta ?? "", LIMITS.damping)]);
    if (modes.length > MOST_MODES || modes.flat().includes(null)) wrong.push(`modes ${given.get("modes")}`);
    else [state.frequency, state.damping] = [modes.map(([w]) => w), modes.map(([, zeta]) => zeta)];
  }
  const plant = page.plants[known];
  if (known === (given.get("plant") ?? known)) {
    if (given.has("output")) {
      const output = number(given.get("output"), [0, plant.outputs.length - 1]);
      if (output === null || !Number.isInteger(output)) wrong.push(`output ${given.get("output")}`);
      else state.output = output;
    }
    if (given.has("parameters")) {
      const texts = given.get("parameters").split(",").filter((text, _, all) => text !== "" || all.length > 1);
      const values = texts.map((text, i) => plant.sliders[i] && number(text, [plant.sliders[i].low, plant.sliders[i].high]));
      if (values.length !== plant.sliders.length || values.some((value) => value === null || value === undefined)) {
        wrong.push(`parameters ${given.get("parameters")}`);
      } else state.parameters = values;
    }
  }
  return { state, wrong };
}

if (typeof module !== "undefined") module.exports = { startState, hashOf, stateOf, ownOf, LIMITS };
