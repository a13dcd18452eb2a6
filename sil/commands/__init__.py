"""The sub-commands of `lever` that simulate, a module each."""
