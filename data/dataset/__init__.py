"""Many logs as one dataset of Parquet files: rebuilt, described, checked, shown and read. Needs pyarrow."""
