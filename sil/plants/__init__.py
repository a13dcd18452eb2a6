"""What is simulated: pilots on their levers, what excites them, and the sensors."""
