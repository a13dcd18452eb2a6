"""The sub-commands of `lever` that simulate, a module each, as in lever_cdkf/commands; pyproject.toml lists them."""
