"""The firmware on a microcontroller: its image, and an emulated board."""
