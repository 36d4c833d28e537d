/* A component's kernels in a page: parameters and inputs in, `start`, `step`, outputs out.

     const module = await WebAssembly.compile(bytes);         // <component>.wasm
     const kernel = new Kernel(module, layout);               // <component>.json
     kernel.set("natural_frequency", [5, 14]);
     kernel.start(0);
     kernel.real("command")[0] = 1;                           // the variable itself, in the module's memory
     kernel.step(0, 0.01);                                    // inputs are held from t over h [s]
     kernel.get("shaped");

   A kernel is one record; several of the same component are several kernels. */

"use strict";

class KernelError extends Error {}

class Kernel {
  /* From a WebAssembly.Module and the component's layout; all variables have their start values. */
  constructor(module, layout) {
    this.layout = layout;
    this.exports = new WebAssembly.Instance(module, {}).exports;
    this.exports._initialize();
    this.memory = this.exports.memory.buffer; // it never grows: views stay valid
    this.record = this.exports.record();
    this.reset();
  }

  /* Gives all variables their start values. */
  reset() {
    this.exports.init();
  }

  /* The elements of a variable, in the module's memory: what is written there is what the kernel reads. */
  real(name) {
    const variable = this.variable(name);
    const kind = variable.kind === "real" ? Float64Array : Int32Array;
    return new kind(this.memory, this.record + variable.offset, variable.size || 1);
  }

  /* A variable's value: a number, or a Boolean; of an array, a list of them. */
  get(name) {
    const variable = this.variable(name);
    const values = Array.from(this.real(name), (value) => (variable.kind === "boolean" ? value !== 0 : value));
    return variable.size ? values : values[0];
  }

  /* Sets an input or parameter: a number, a Boolean, the name of an enumeration's item; of an array, its first elements. */
  set(name, value) {
    const variable = this.variable(name);
    if (variable.causality !== "input" && variable.causality !== "parameter") {
      throw new KernelError(`${this.layout.component}: ${name} is no input and no parameter`);
    }
    const values = Array.isArray(value) ? value : [value];
    if (values.length > (variable.size || 1)) {
      throw new KernelError(`${this.layout.component}: ${name} has ${variable.size || 1} elements, not ${values.length}`);
    }
    const elements = this.real(name);
    values.forEach((one, i) => (elements[i] = this.number(name, variable, one)));
  }

  /* Calculated values and the first outputs from parameters and inputs, at the time t [s]. Throws KernelError. */
  start(t) {
    this.check(this.exports.start(t), t);
  }

  /* Outputs at t + h, for inputs that are held over the step; h may be 0 at an event. Throws KernelError. */
  step(t, h) {
    const status = this.exports.step(t, h);
    if (status !== 0 || this.fault[0] !== 0) this.check(status, t);
  }

  variable(name) {
    const variable = this.layout.variables[name];
    if (!variable) throw new KernelError(`${this.layout.component} has no variable ${name}`);
    return variable;
  }

  number(name, variable, value) {
    if (variable.items && typeof value === "string") {
      if (!(value in variable.items)) throw new KernelError(`${this.layout.component}: ${value} is not a value of ${name}`);
      return variable.items[value];
    }
    const number = typeof value === "boolean" ? Number(value) : value;
    const whole = variable.kind === "real" || (Number.isInteger(number) && Math.abs(number) < 2 ** 31);
    if (typeof number !== "number" || !whole) {
      throw new KernelError(`${this.layout.component}: ${name} = ${value} is not of type ${variable.kind}`);
    }
    return number;
  }

  get fault() {
    return (this.faults ??= new Uint32Array(this.memory, this.exports.fault(), 3)); // what, name, where
  }

  check(status, t) {
    const [what, name, where] = this.fault;
    if (what !== 0) {
      const [value] = new Float64Array(this.memory, this.exports.fault() + 16, 1);
      const words = [this.text(what), this.text(name) && `: ${this.text(name)} = ${value}`, this.text(where) && ` (${this.text(where)})`];
      throw new KernelError(`${this.layout.component}: ${words.filter(Boolean).join("")}, t = ${t} s`);
    }
    if (status !== 0) throw new KernelError(`${this.layout.component}: ${this.message(status)} (t = ${t} s)`);
  }

  /* The text of a kernel's status number, with the values of the variables that it names. */
  message(status) {
    const text = this.layout.messages[status] ?? `failed with status ${status}`;
    return text.replace(/\{(\w+)\}/g, (whole, name) => {
      const variable = this.layout.variables[name];
      if (!variable) return whole;
      const value = this.get(name);
      if (variable.items) return Object.keys(variable.items).find((key) => variable.items[key] === value) ?? value;
      return typeof value === "number" ? Number(value.toPrecision(9)) : value;
    });
  }

  text(address) {
    if (address === 0) return "";
    const bytes = new Uint8Array(this.memory, address);
    return new TextDecoder().decode(bytes.subarray(0, bytes.indexOf(0)));
  }
}

if (typeof module !== "undefined") module.exports = { Kernel, KernelError };
