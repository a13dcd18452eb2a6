"""The command `lever`: where it starts, its parser and help, and what commands print: tables, progress, sentences."""
