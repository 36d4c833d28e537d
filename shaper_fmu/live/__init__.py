"""A page on which shaping is tried: the components' kernels as WebAssembly, designed and simulated while a slider moves."""
