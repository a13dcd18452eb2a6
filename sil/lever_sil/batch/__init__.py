"""Many runs at once, a lane each: motions and their truth, the levers, their sensors, and the firmware."""
