"""From a component to an FMU."""
