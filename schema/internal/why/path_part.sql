-- title: What the latency of one path consists of
-- description: Rows of path-breakdown, of the path that is explained.
-- grain: one row per hop, part, and callback that it belongs to
-- reads: breakdown
-- param: path VARCHAR  The path
FROM breakdown
WHERE path = $path
