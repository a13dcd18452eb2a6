"""`lever faults`: every received message and signal, wronged in every way that a bus, a sender or a sensor can."""
