"""Sub-commands of `lever`, a module each: ../cli/main.py says what such a module has; pyproject.toml lists them."""
