"""FMUs of FMI 3.0 as components of WebAssembly, as the draft of the layered standard fmi-ls-wasm of July 2026 says."""
