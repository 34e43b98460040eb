-- description: Timers and topics that were busy, and stopped until the end of a run, though their
--     process goes on; where they began with it, or soon after. Others come and go.
-- grain: one row per timer, or publisher
-- param: only_run BIGINT  The run
-- column: run_id, process_id
-- column: node_id BIGINT  Node that has it; NULL: not known
-- column: what VARCHAR  'timer' or 'topic'
-- column: object_id BIGINT  Its identity: a callback_id, or a publisher_id
-- column: topic_name VARCHAR [topic]  Topic; NULL: of a timer
-- column: last_ns BIGINT [epoch ns]  When it was seen last, as recorded
-- column: at_ns BIGINT [epoch ns]  When it was seen last
-- column: count BIGINT  How many times are missing since
-- column: usual_ns BIGINT [ns]  Median time from one to the next
-- column: near_ns BIGINT [ns]  What is not further from at_ns may have to do with it
CREATE OR REPLACE MACRO main.stopped_series(only_run) AS TABLE
WITH silent AS MATERIALIZED (FROM derive.silent_object WHERE run_id = only_run),
settled AS MATERIALIZED (FROM main.settled([only_run], NULL, NULL)),
period AS MATERIALIZED (
    SELECT
        s.run_id, s.what,
        s.object_id AS series_id,
        t.start_ns AS at_ns,
        t.start_ns - lag(t.start_ns) OVER (
            PARTITION BY s.what, s.object_id ORDER BY t.start_ns
        ) AS value
    FROM silent AS s
    JOIN (
        SELECT
            'timer' AS what,
            callback_id AS object_id,
            start_ns
        FROM main.callback_instance
        UNION ALL
        SELECT 'topic', publisher_id, start_ns
        FROM main.publication
    ) AS t ON s.what = t.what AND s.object_id = t.object_id
),
pause AS MATERIALIZED (FROM main.value_pause('period', 'settled'))
SELECT
    s.*,
    p.at_ns, p.count,
    p.usual::BIGINT AS usual_ns,
    -- From one time to the next at most.
    p.usual::BIGINT + 1_000_000_000 AS near_ns
FROM pause AS p
JOIN silent AS s ON p.what = s.what AND p.series_id = s.object_id
JOIN main.process AS o ON s.process_id = o.process_id
-- What began long after its process comes and goes.
LEFT JOIN pause AS b
    ON b.kind = 'begin'
    AND p.what = b.what
    AND p.series_id = b.series_id
    AND b.at_ns > o.first_seen_ns + 10_000_000_000
WHERE p.kind = 'stop'
    AND b.kind IS NULL
    AND o.last_seen_ns - p.at_ns > p.longest_ns / 2
