"""The helicopter around the lever: what closes the loop of collective bounce."""
