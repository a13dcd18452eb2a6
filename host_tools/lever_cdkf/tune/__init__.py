"""Settings from a recorded log, by the likelihood of the firmware's innovations: `lever tune`.

`{tune_page, validation, calibration} → search → likelihood → recording`. The filter that is tuned is the
firmware's own C code (lever_cdkf/firmware/innovations.py); the optimisers are SciPy's.
"""
