"""The sub-commands of `lever` that simulate, a module each, as in host_tools/commands; pyproject.toml lists them."""
