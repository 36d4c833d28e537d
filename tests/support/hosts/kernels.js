/* Replays what plain Python has done (kernel_traces.py): the largest difference, relative to values above 1, and what was refused. */

async function replayed(bytes, layout, traces) {
  const module = await WebAssembly.compile(bytes);
  const told = { imports: WebAssembly.Module.imports(module).length, worst: 0, where: "", compared: 0, wrong: [] };
  const kernel = new Kernel(module, layout);

  function attempt(name, expected, call) {
    try {
      call();
    } catch (error) {
      if (!(error instanceof KernelError)) throw error;
      if (expected) told.wrong.push(`${name}: ${error.message}`);
      return;
    }
    if (!expected) return void told.wrong.push(`${name}: not refused`);
    for (const [variable, value] of Object.entries(expected)) {
      const found = [kernel.get(variable)].flat();
      [value].flat().forEach((one, i) => {
        const difference = Math.abs(Number(found[i]) - Number(one)) / Math.max(1, Math.abs(Number(one)));
        told.compared++;
        if (!(difference <= told.worst)) [told.worst, told.where] = [difference, `${name}: ${variable} ${found[i]} ${one}`];
      });
    }
  }

  traces.forEach((trace, k) => {
    kernel.reset();
    for (const [name, value] of Object.entries(trace.parameters)) kernel.set(name, value);
    attempt(`trace ${k}, start`, trace.started, () => kernel.start(0));
    trace.steps.forEach(([inputs, t, h, expected], i) => {
      for (const [name, value] of Object.entries(inputs)) kernel.set(name, value);
      attempt(`trace ${k}, step ${i}`, expected, () => kernel.step(t, h));
    });
  });
  return told;
}
