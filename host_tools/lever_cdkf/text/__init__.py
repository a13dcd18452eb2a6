"""What users write: quantities with units, TOML, and the nearest name to a mistyped one."""
