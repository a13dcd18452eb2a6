"""`lever campaign`: a scenario over a design of its values, on Dask, a Parquet file a chunk."""
