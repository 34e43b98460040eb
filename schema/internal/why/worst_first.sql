-- title: Paths, the one that is explained first
-- description: Rows of e2e-latency, the slowest first behind the path that is explained.
-- grain: one row per path
-- reads: paths
-- param: path VARCHAR  The path
FROM paths
ORDER BY path <> $path, p95_ns DESC NULLS LAST, path
