-- title: The longest pieces of a slow flow
-- description: Rows of critical-path: the longest pieces of one flow, in their order, so many
--     that no more than a tenth is left, and behind them the sum of all others. It has the columns
--     of its input.
-- grain: one row per piece
-- reads: slow_flow
-- param: count BIGINT = 5  How many pieces, if they are enough
WITH piece AS (
    SELECT
        *,
        row_number() OVER () AS place
    FROM slow_flow
),
longest AS (
    SELECT *
    FROM piece
    WHERE activity IS DISTINCT FROM 'rest'
    WINDOW longest AS (ORDER BY duration_ns DESC, place)
    QUALIFY row_number() OVER longest <= $count
        OR coalesce(sum(duration_ns) OVER (
            longest ROWS BETWEEN UNBOUNDED PRECEDING AND 1 PRECEDING
        ), 0) < 0.9 * latency_ns
)
SELECT * EXCLUDE (place)
FROM (
    FROM longest
    UNION ALL BY NAME
    SELECT
        any_value(run_id) AS run_id,
        any_value(rank) AS rank,
        any_value(take_id) AS take_id,
        any_value(latency_ns) AS latency_ns,
        sum(duration_ns)::BIGINT AS duration_ns,
        sum(pieces)::BIGINT AS pieces,
        'rest' AS activity,
        round(coalesce(sum(share), 0), 4) AS share,
        max(place) + 1 AS place
    FROM piece
    WHERE place NOT IN (SELECT place FROM longest)
    HAVING count(*) > 0
)
ORDER BY place
