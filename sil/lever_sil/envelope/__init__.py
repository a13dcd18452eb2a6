"""`lever envelope`: what a collective meets every minute, by a plant that shares nothing with the filter's model."""
