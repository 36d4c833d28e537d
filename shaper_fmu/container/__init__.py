"""Systems of FMUs as one FMU: the master's loop, with the FMUs in its resources."""
