"""Lists the events of traces in time order, without a database: as text, JSON, CSV or Parquet."""
