"""From a plant to what a shaper needs to know of it: experiments on FMUs, and measured responses."""
