-- description: The share of each node in the time of one path, and the largest of its parts.
-- grain: one row per node
-- reads: breakdown
-- param: path VARCHAR  The path
WITH part AS (
    SELECT
        *,
        row_number() OVER () AS place
    FROM breakdown
),
longest AS (
    SELECT
        *,
        row_number() OVER (PARTITION BY node ORDER BY total_ns DESC, place) = 1 AS is_longest,
        sum(share) OVER (PARTITION BY node) AS node_share,
        sum(total_ns) OVER (PARTITION BY node) AS node_ns
    FROM part
    WHERE path = $path
)
SELECT
    node,
    coalesce(node_share, 0) AS share,
    node_ns::BIGINT AS total_ns,
    part, what, median_ns, max_ns
FROM longest
WHERE is_longest
ORDER BY total_ns DESC, node
