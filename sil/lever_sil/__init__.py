"""Software in the loop: a lever and a pilot's arm to be estimated, what measures them, and the runs over CAN.

Kept empty so that `lever --help` does not load numpy; see README.md for the modules.
"""
