"""`lever bounce`: flights in which a pilot may close the loop of collective bounce, and what the firmware does then."""
