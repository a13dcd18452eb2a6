"""Sub-commands of `lever`, a module each: ../cli.py says what such a module has; pyproject.toml lists them."""
