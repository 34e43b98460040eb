-- title: Which paths were slow around a moment
-- description: Flows that were on their way in the second around it, with those of all the run:
--     paths on which none was that should be, or half of them took a tenth longer than usual, or
--     one took twice as long.
-- grain: one row per path
-- reads: path_outcome, named_path
-- param: at_ns BIGINT  The moment, epoch ns
-- column: path VARCHAR  The path
-- column: flows BIGINT  Flows that were on their way, and arrived
-- column: usual_flows DOUBLE  How many are on their way in any second
-- column: median_ns BIGINT [ns]  Their median latency
-- column: max_ns BIGINT [ns]  The longest of them
-- column: usual_ns BIGINT [ns]  Median of the run
WITH flow AS (
    SELECT
        p.path, o.root_ns, o.latency_ns,
        o.root_ns < $at_ns + 500_000_000 AND o.sink_ns > $at_ns - 500_000_000 AS is_near
    FROM path_outcome AS o
    JOIN named_path AS p ON o.alike_id = p.path_id
    WHERE o.is_first AND o.latency_ns > 0
)
SELECT
    path,
    count(*) FILTER (is_near) AS flows,
    sum(1e9 + latency_ns) / (max(root_ns) - min(root_ns) + 1e9) AS usual_flows,
    (median(latency_ns) FILTER (is_near))::BIGINT AS median_ns,
    max(latency_ns) FILTER (is_near) AS max_ns,
    median(latency_ns)::BIGINT AS usual_ns
FROM flow
GROUP BY path
HAVING (flows = 0 AND usual_flows >= 2)
    OR median_ns >= 1.1 * usual_ns
    OR max_ns >= 2 * usual_ns
ORDER BY flows > 0, median_ns - usual_ns DESC, path
LIMIT 5
