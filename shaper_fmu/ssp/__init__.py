"""System Structure and Parameterization (SSP): systems as archives."""
