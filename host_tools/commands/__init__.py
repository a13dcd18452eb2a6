"""Sub-commands of `lever`, a module each; cli.py says what such a module is."""
