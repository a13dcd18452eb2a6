"""`lever compare`: every estimator on the same data, judged alike.

cases.py       what is run: matched walks, steps, wrong noise, recorded scenarios, in a registry;  dataset.py: as files
entrants.py    who runs: the firmware in several configurations, and the baselines
run_cases.py   runs them, in processes, and brings back errors
evaluation.py  makes one row of figures of each;  comparison.py: who has smaller errors than whom
verdicts.py    says who wins where, and whether what was promised is kept
paper.py       the tables of the experiment of the paper
table.py       rows as tables and as CSV;  compare_page.py, charts.py: as a page for a browser;  printed.py: for print
"""
