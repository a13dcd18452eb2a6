"""FMUs (FMI 3.0 Co-Simulation): model description, sources, binary and documentation of one, as an archive."""
