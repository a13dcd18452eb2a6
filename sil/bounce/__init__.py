"""`lever bounce`: flights of a helicopter whose pilot closes the loop of collective bounce, and what the firmware makes of
it."""
