"""One instance of the firmware for a day: pilots who drift, grip and move, and sensors that fail."""
