"""The closed loop of a scenario in C: plant, sensors and firmware, some thousand times faster than real time."""
