"""Text that users write and read: quantities with units, counts, TOML, and the nearest name to a mistyped one."""
