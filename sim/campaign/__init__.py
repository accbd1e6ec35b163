"""Campaigns: thousands of runs of one scenario in a compiled loop, over all cores or a cluster, kept as Parquet."""
