"""Named queries: catalogue of `queries/*.sql`, header parser, parameters, runner, result."""
