"""The process and its installation: files, provenance, optional dependencies, and Ctrl-C."""
