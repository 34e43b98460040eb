"""SQL as files and as errors: headers, values of parameters, failures in words, interruption."""
