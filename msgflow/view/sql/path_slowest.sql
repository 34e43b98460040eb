-- description: The slowest flows of a path, or of every path.
-- grain: one row per flow
-- param: path BIGINT = NULL  Number of the path; every one when NULL
-- param: limit BIGINT {1..50000} = 10  Most flows of a path
-- param: begin_at, end_at
-- column: path_id BIGINT  Number of the path
-- column: root_at, root_kind, root_id
-- column: take_id BIGINT  Take at the end
-- column: latency BIGINT [ns]  Latency
SELECT path_id, root_at, root_kind, root_id, take_id, latency
FROM chosen_flow
WHERE latency IS NOT NULL
QUALIFY row_number() OVER (
    PARTITION BY path_id ORDER BY latency DESC, root_at, root_kind, root_id
) <= $limit
ORDER BY path_id, latency DESC, root_at, root_kind, root_id
