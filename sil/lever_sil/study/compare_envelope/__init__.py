"""`lever compare --envelope`: joint EKF and UKF on the logs of `lever envelope`, beside the firmware.

logs.py            the conditions of lever_sil/envelope as logs: what the sensors said, and what the firmware made of it
filters.py         the joint filters on a log, with and without a high-pass
run_estimators.py  runs both, in processes, and brings back figures of each run
tables.py          tables and verdicts
"""
