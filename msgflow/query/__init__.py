"""Named queries: catalogue of `queries/*.sql`, parameters, runner."""
