-- description: How long callback instances waited in their executor, and what for: see
--     main.executor_wait.
-- grain: one row per waiting callback instance
-- param: waits VARCHAR  Name of rows as of derive.callback_ready
-- param: has_teams
CREATE OR REPLACE MACRO derive.executor_waits(waits, has_teams := true) AS TABLE
WITH ready AS MATERIALIZED (FROM query_table(waits)),
full_house AS MATERIALIZED (
    SELECT executor_id, start_ns, end_ns, before_ns FROM derive.executor_busy
),
exclusion AS MATERIALIZED (FROM derive.callback_exclusion WHERE has_teams),
-- For how long the executor had been busy up to each moment: the difference of two such sums is
-- how long it was between them.
busy AS MATERIALIZED (
    SELECT
        r.callback_instance_id, r.callback_id, r.earliest_ns, r.latest_ns, r.start_ns,
        CASE WHEN r.earliest_ns IS NOT NULL THEN derive.passed_ns(e, r.earliest_ns) END
            AS until_earliest_ns,
        derive.passed_ns(l, r.latest_ns) AS until_latest_ns,
        derive.passed_ns(s, r.start_ns) AS until_start_ns
    FROM (
        SELECT callback_instance_id, callback_id, executor_id, earliest_ns, latest_ns, start_ns
        FROM ready
    ) AS r
    ASOF LEFT JOIN full_house AS e
        ON r.executor_id = e.executor_id AND r.earliest_ns >= e.start_ns
    ASOF LEFT JOIN full_house AS l ON r.executor_id = l.executor_id AND r.latest_ns >= l.start_ns
    ASOF LEFT JOIN full_house AS s ON r.executor_id = s.executor_id AND r.start_ns >= s.start_ns
),
-- Callback instances that kept others from starting although a thread of their executor was free,
-- because a callback of one excludes that of the other. With the sum of all such time before.
excluding AS (
    SELECT
        r.run_id, x.kind, x.exclusion_id, r.callback_instance_id, r.start_ns, r.end_ns,
        derive.passed_ns(s, r.start_ns) AS start_busy_ns,
        r.end_ns - r.start_ns - derive.passed_ns(e, r.end_ns) + derive.passed_ns(s, r.start_ns)
            AS blocked_ns
    FROM derive.executor_run AS r
    JOIN exclusion AS x ON r.callback_id = x.callback_id
    JOIN derive.executor_size AS n ON r.executor_id = n.executor_id
    ASOF LEFT JOIN full_house AS s ON r.executor_id = s.executor_id AND r.start_ns >= s.start_ns
    ASOF LEFT JOIN full_house AS e ON r.executor_id = e.executor_id AND r.end_ns >= e.start_ns
    WHERE has_teams AND r.end_ns > r.start_ns AND n.thread_count > 1
),
blocking AS (
    SELECT
        kind, exclusion_id, start_ns, end_ns, start_busy_ns, blocked_ns,
        coalesce(sum(blocked_ns) OVER (
            PARTITION BY run_id, kind, exclusion_id ORDER BY start_ns, callback_instance_id
            ROWS BETWEEN UNBOUNDED PRECEDING AND 1 PRECEDING
        ), 0)::BIGINT AS before_ns
    FROM excluding
),
blocked AS (
    SELECT
        b.callback_instance_id,
        derive.blocked_ns(s, b.start_ns, b.until_start_ns)
        - derive.blocked_ns(l, b.latest_ns, b.until_latest_ns) AS min_ns,
        derive.blocked_ns(s, b.start_ns, b.until_start_ns)
        - derive.blocked_ns(e, b.earliest_ns, b.until_earliest_ns) AS max_ns
    FROM (
        SELECT y.*, x.kind, x.exclusion_id
        FROM busy AS y
        JOIN exclusion AS x ON y.callback_id = x.callback_id
        WHERE has_teams
    ) AS b
    ASOF LEFT JOIN blocking AS e
        ON b.kind = e.kind AND b.exclusion_id = e.exclusion_id AND b.earliest_ns >= e.start_ns
    ASOF LEFT JOIN blocking AS l
        ON b.kind = l.kind AND b.exclusion_id = l.exclusion_id AND b.latest_ns >= l.start_ns
    ASOF LEFT JOIN blocking AS s
        ON b.kind = s.kind AND b.exclusion_id = s.exclusion_id AND b.start_ns >= s.start_ns
),
looked_up AS (
    SELECT DISTINCT
        executor_id,
        NULL::BIGINT AS until_ns
    FROM ready
),
poll AS MATERIALIZED (
    SELECT executor_id, start_ns, end_ns, before_ns FROM derive.executor_poll('looked_up')
),
-- What a thread has picked does not wait for work that others wait for.
idle AS (
    SELECT
        r.callback_instance_id,
        derive.passed_ns(p, r.until_ns) - derive.passed_ns(e, r.earliest_ns) AS idle_ns
    FROM (
        SELECT
            callback_instance_id, executor_id, earliest_ns,
            greatest(picked_ns, earliest_ns) AS until_ns
        FROM ready
    ) AS r
    ASOF LEFT JOIN poll AS e ON r.executor_id = e.executor_id AND r.earliest_ns >= e.start_ns
    ASOF LEFT JOIN poll AS p ON r.executor_id = p.executor_id AND r.until_ns >= p.start_ns
),
measured AS (
    SELECT
        r.run_id, r.executor_id, r.thread_id, r.callback_id, r.callback_instance_id, r.since,
        r.origin_ns, r.earliest_ns, r.latest_ns, r.start_ns, r.is_loss_affected, r.thread_count,
        b.until_start_ns - b.until_latest_ns + coalesce(x.min_ns, 0) AS busy_min_ns,
        b.until_start_ns - b.until_earliest_ns + coalesce(x.max_ns, 0) AS busy_max_ns,
        CASE WHEN r.earliest_ns IS NOT NULL THEN coalesce(x.max_ns, 0) END AS blocked_max_ns,
        CASE WHEN r.earliest_ns IS NOT NULL AND r.executor_id IN (SELECT executor_id FROM poll)
            THEN i.idle_ns END AS idle_ns,
        -- From the end of one wait to the begin of the next, which found the input.
        CASE WHEN r.thread_count = 1 AND NOT r.is_loss_affected
            THEN r.wait_start_ns - greatest(r.earliest_ns, r.previous_wait_end_ns)
                - CASE WHEN r.latest_ns < r.wait_start_ns THEN b.until_start_ns
                    ELSE b.until_latest_ns END
                + b.until_earliest_ns END AS away_ns
    FROM ready AS r
    JOIN busy AS b ON r.callback_instance_id = b.callback_instance_id
    LEFT JOIN blocked AS x ON r.callback_instance_id = x.callback_instance_id
    JOIN idle AS i ON r.callback_instance_id = i.callback_instance_id
)
SELECT
    r.run_id, r.callback_instance_id, r.executor_id, r.thread_id, r.callback_id, r.since,
    derive.corrected_ns(r.origin_ns, c) AS origin_ns,
    derive.corrected_ns(r.earliest_ns, c) AS earliest_ns,
    derive.corrected_ns(r.latest_ns, c) AS latest_ns,
    derive.corrected_ns(r.start_ns, c) AS start_ns,
    r.start_ns - r.origin_ns AS wait_ns,
    r.busy_min_ns, r.busy_max_ns, r.blocked_max_ns, r.idle_ns, r.is_loss_affected,
    -- An excluded callback may wait while a thread is idle: then more was held than this says.
    CASE
        WHEN r.thread_count > 1 AND r.idle_ns IS NOT NULL
            THEN greatest(r.start_ns - r.earliest_ns - r.idle_ns - r.busy_max_ns, 0)
        -- Less is what an executor does between two waits anyway.
        WHEN r.away_ns >= 1_000_000 THEN r.away_ns
    END AS held_max_ns
FROM measured AS r
JOIN store.thread AS t ON r.thread_id = t.thread_id
JOIN derive.process_clock AS c ON t.process_id = c.process_id
