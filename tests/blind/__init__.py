"""An oracle of the supervision, written from the requirements by somebody who has not read the code."""
