"""What is simulated: pilots on their levers, what excites them, and the sensors.

A new plant: a module with the interface of truth.py, and its table in pilots.py.
"""
