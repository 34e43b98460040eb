-- description: Between which moments a run is looked at for changes. The nodes that begin with the
--     first one, each within 3 s of the one before, take a second to settle. Where half of the
--     processes end within 5 s of the last one, and that within 15 s of the end, the run ends when
--     the first of these ends, within 2 s.
-- grain: one row per run
-- param: runs
-- param: window_start_ns BIGINT  Not before this moment, epoch ns; NULL: any
-- param: window_end_ns BIGINT  Only before this moment, epoch ns; NULL: any
-- column: run_id, start_ns, end_ns
CREATE OR REPLACE MACRO main.settled(runs, window_start_ns, window_end_ns) AS TABLE
WITH created AS (
    SELECT
        run_id, created_ns,
        created_ns - lag(created_ns) OVER (PARTITION BY run_id ORDER BY created_ns) AS pause_ns
    FROM main.node
    WHERE list_contains(runs, run_id) AND created_ns IS NOT NULL
),
counted AS (
    SELECT
        run_id, created_ns,
        count(*) FILTER (pause_ns > 3_000_000_000) OVER (PARTITION BY run_id ORDER BY created_ns)
            AS pauses
    FROM created
),
begun AS (
    SELECT
        run_id,
        max(created_ns) + 1_000_000_000 AS start_ns
    FROM counted
    WHERE pauses = 0
    GROUP BY run_id
),
seen AS (
    SELECT
        run_id, last_seen_ns,
        quantile_disc(last_seen_ns, 0.5) OVER of_run AS half_ns,
        max(last_seen_ns) OVER of_run AS last_ns
    FROM main.process
    WHERE list_contains(runs, run_id)
        AND process_id IN (SELECT process_id FROM main.node WHERE list_contains(runs, run_id))
    WINDOW of_run AS (PARTITION BY run_id)
),
ended AS (
    SELECT
        run_id, last_ns,
        min(last_seen_ns) AS end_ns
    FROM seen
    WHERE last_seen_ns > half_ns - 2_000_000_000 AND half_ns > last_ns - 5_000_000_000
    GROUP BY run_id, last_ns
)
SELECT
    r.run_id,
    greatest(r.start_ns, window_start_ns, b.start_ns) AS start_ns,
    least(
        r.end_ns, window_end_ns,
        -- A launch may wait 10 s for one that does not end.
        CASE WHEN e.last_ns > r.end_ns - 15_000_000_000 THEN e.end_ns END
    ) AS end_ns
FROM main.run AS r
LEFT JOIN begun AS b ON r.run_id = b.run_id
LEFT JOIN ended AS e ON r.run_id = e.run_id
WHERE list_contains(runs, r.run_id) AND r.start_ns IS NOT NULL AND r.end_ns IS NOT NULL
