-- description: The run of the same system that was recorded last before a run. Two runs are of one
--     system if at least half of the nodes of both are in both.
-- grain: one row, none where there is no such run
-- column: run_id BIGINT  The run before it
WITH known AS (SELECT DISTINCT run_id, full_name FROM main.node WHERE full_name IS NOT NULL),
own AS (SELECT full_name FROM known WHERE run_id = $run),
other AS (
    SELECT
        k.run_id,
        count(*) AS nodes,
        count(o.full_name) AS common
    FROM known AS k
    LEFT JOIN own AS o ON k.full_name = o.full_name
    WHERE k.run_id <> $run
    GROUP BY k.run_id
)
SELECT o.run_id
FROM other AS o
JOIN main.run AS r ON o.run_id = r.run_id
JOIN main.run AS c ON c.run_id = $run
WHERE (r.start_ns, r.run_id) < (c.start_ns, c.run_id)
    AND 2 * o.common >= o.nodes + (SELECT count(*) FROM own) - o.common
ORDER BY r.start_ns DESC, r.run_id DESC
LIMIT 1
