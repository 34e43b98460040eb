"""Events of traces in order of time, without a database: as text, JSON, CSV or Parquet."""
