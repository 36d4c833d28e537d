/* The page's controls: choices, and sliders that have a number beside them. */

"use strict";

const TICKS = 1000; // of a slider
const HERTZ = ["Hz", 0.5 / Math.PI]; // the unit beside rad/s, and its factor

function choice(select, items, chosen, changed) {
  select.replaceChildren();
  for (const item of items) {
    if (Array.isArray(item)) select.append(new Option(item[1], item[0]));
    else {
      const group = document.createElement("optgroup");
      group.label = item.title;
      for (const [value, text] of item.items) group.append(new Option(text, value));
      select.append(group);
    }
  }
  select.value = chosen;
  select.onchange = () => changed(select.value);
}

/* A slider for { key, label, unit, low, high, log, whole } with a value; `changed` is called while it moves. */
function slider(into, told, value, changed) {
  const row = document.createElement("div");
  row.className = "slider";
  const [range, number] = ["range", "number"].map((type) => Object.assign(document.createElement("input"), { type }));
  const id = `slider-${told.key}`;
  const label = document.createElement("label");
  Object.assign(label, { htmlFor: id, textContent: told.label });
  const unit = document.createElement("span");
  unit.className = "unit";
  const toTick = (x) => Math.round(TICKS * (told.log ? Math.log(x / told.low) / Math.log(told.high / told.low) : (x - told.low) / (told.high - told.low)));
  const rounded = (x) => Number(x.toPrecision(4));
  const fromTick = (k) => {
    const share = k / TICKS;
    const x = told.log ? told.low * (told.high / told.low) ** share : told.low + (told.high - told.low) * share;
    return Math.min(told.high, Math.max(told.low, told.whole ? Math.round(x) : rounded(x)));
  };
  const inHertz = told.unit === "rad/s" && told.label.includes("frequency");
  const tell = (x) => {
    const beside = inHertz ? `${Number((x * HERTZ[1]).toPrecision(4))} ${HERTZ[0]}` : "";
    unit.replaceChildren(told.unit, ...(beside ? [document.createElement("br"), beside] : []));
    range.setAttribute("aria-valuetext", `${x} ${told.unit}${beside ? `, ${beside}` : ""}`.trim());
  };
  const show = (x) => {
    range.value = toTick(x);
    tell(x);
    if (document.activeElement !== number) number.value = x;
  };
  Object.assign(range, { id, min: 0, max: TICKS, step: 1 });
  Object.assign(number, { id: `${id}-number`, step: "any", min: told.low, max: told.high });
  number.setAttribute("aria-label", `${told.label}, number`);
  range.addEventListener("input", () => {
    const x = fromTick(Number(range.value));
    number.value = x;
    tell(x);
    changed(x);
  });
  number.addEventListener("input", () => {
    const x = Number(number.value);
    const right = number.value !== "" && x >= told.low && x <= told.high;
    number.setCustomValidity(right ? "" : `${told.low} to ${told.high} ${told.unit}`);
    number.setAttribute("aria-invalid", String(!right));
    if (!right) return void number.reportValidity();
    range.value = toTick(x);
    tell(x);
    changed(x);
  });
  show(value);
  row.append(label, range, number, unit);
  into.append(row);
}

function sliders(into, all, value, changed) {
  const focused = document.activeElement?.id;
  into.replaceChildren();
  all.forEach((told) => slider(into, told, value(told), (x) => changed(told, x)));
  if (focused && focused.startsWith("slider-")) document.getElementById(focused)?.focus();
}
