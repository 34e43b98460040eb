-- description: The bar on the same row of the timeline that begins next, or before.
-- grain: one row per bar found
-- param: row BIGINT  Row of the timeline
-- param: kind BIGINT  Kind of the bar
-- param: id BIGINT  Identity of the thing
-- param: step BIGINT {-1..1}  1: next, -1: previous
-- column: kind UTINYINT  Kind of the bar
-- column: id BIGINT  Identity of the thing
-- column: start_at BIGINT [ns since origin]  Begin
-- column: length BIGINT [ns]  Length
WITH numbered AS (
    SELECT
        kind, id, start_ns, end_ns,
        row_number() OVER (ORDER BY start_ns, id) AS position
    FROM bar
    WHERE run_id = $run AND row_key = $row AND kind = $kind
)
SELECT
    kind, id,
    start_ns - $origin_ns AS start_at,
    end_ns - start_ns AS length
FROM numbered
WHERE position = (SELECT position + $step FROM numbered WHERE id = $id)
ORDER BY start_at
