"""The simulated pilot as an FMU (FMI 3.0 Co-Simulation)."""
