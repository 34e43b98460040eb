"""Results as text and files: tables for people, CSV, JSON, Markdown and Parquet for programs."""
