"""The signals of a run in files for other tools: CSV, ASAM MDF 4, MCAP and Parquet."""
