-- description: How long callback instances waited in their executor, and what for: see
--     main.executor_wait.
-- grain: one row per waiting callback instance
-- param: waits VARCHAR  Name of rows as of derive.callback_ready
-- param: has_teams
CREATE OR REPLACE MACRO derive.executor_waits(waits, has_teams := true) AS TABLE
WITH stretch AS MATERIALIZED (
    SELECT executor_id, start_ns, end_ns, before_ns, callback_instance_id, previous_end_ns
    FROM derive.executor_busy
    -- The rows of several threads are of no callback instance.
    WHERE has_teams OR callback_instance_id IS NOT NULL
),
exclusion AS MATERIALIZED (FROM derive.callback_exclusion WHERE has_teams),
-- The one thread of an executor starts a callback when nothing else runs: up to there it was busy
-- for as long as it was in all before, and not at all from the end of the last one.
ready AS MATERIALIZED (
    SELECT
        r.*, b.before_ns AS start_busy_ns,
        CASE WHEN r.earliest_ns >= coalesce(b.previous_end_ns, r.earliest_ns) THEN b.before_ns END
            AS earliest_busy_ns,
        CASE WHEN r.latest_ns >= coalesce(b.previous_end_ns, r.latest_ns) THEN b.before_ns END
            AS latest_busy_ns
    FROM query_table(waits) AS r
    -- What others may exclude needs all its moments.
    LEFT JOIN (SELECT DISTINCT callback_id FROM exclusion) AS e
        ON r.callback_id = e.callback_id
    LEFT JOIN stretch AS b
        ON r.callback_instance_id = b.callback_instance_id AND e.callback_id IS NULL
),
-- How much of each kind of time there was up to other moments: the difference of two such sums is
-- what there was between them.
moment AS MATERIALIZED (
    SELECT callback_instance_id, callback_id, executor_id, 'earliest' AS which, earliest_ns AS at_ns
    FROM ready
    WHERE earliest_ns IS NOT NULL AND earliest_busy_ns IS NULL
    UNION ALL
    SELECT callback_instance_id, callback_id, executor_id, 'latest', latest_ns
    FROM ready
    WHERE latest_busy_ns IS NULL
    UNION ALL
    SELECT callback_instance_id, callback_id, executor_id, 'start', start_ns
    FROM ready
    WHERE start_busy_ns IS NULL
),
busy AS MATERIALIZED (
    SELECT
        m.callback_instance_id, m.callback_id, m.which, m.at_ns,
        coalesce(b.before_ns + least(m.at_ns, b.end_ns) - b.start_ns, 0) AS until_ns
    FROM moment AS m
    ASOF LEFT JOIN (
        SELECT executor_id, start_ns, end_ns, before_ns
        FROM stretch
        -- Often it is only the first callbacks that have such moments.
        WHERE executor_id IN (SELECT executor_id FROM moment)
            AND start_ns <= (SELECT max(at_ns) FROM moment)
    ) AS b ON m.executor_id = b.executor_id AND m.at_ns >= b.start_ns
),
-- Callback instances that kept others from starting although a thread of their executor was free,
-- because a callback of one excludes that of the other. With the sum of all such time before.
excluding AS (
    SELECT
        r.run_id, r.executor_id, e.kind, e.exclusion_id, r.callback_instance_id, r.start_ns,
        r.end_ns
    FROM derive.executor_run AS r
    JOIN derive.executor_size AS s ON r.executor_id = s.executor_id
    JOIN exclusion AS e ON r.callback_id = e.callback_id
    WHERE has_teams AND r.end_ns > r.start_ns AND s.thread_count > 1
),
blocking AS (
    SELECT
        kind, exclusion_id, start_ns, end_ns, start_busy_ns,
        end_ns - start_ns - (end_busy_ns - start_busy_ns) AS blocked_ns,
        coalesce(sum(end_ns - start_ns - (end_busy_ns - start_busy_ns)) OVER (
            PARTITION BY run_id, kind, exclusion_id ORDER BY start_ns, callback_instance_id
            ROWS BETWEEN UNBOUNDED PRECEDING AND 1 PRECEDING
        ), 0)::BIGINT AS before_ns
    FROM (
        SELECT
            r.*,
            coalesce(s.before_ns + least(r.start_ns, s.end_ns) - s.start_ns, 0) AS start_busy_ns,
            coalesce(e.before_ns + least(r.end_ns, e.end_ns) - e.start_ns, 0) AS end_busy_ns
        FROM excluding AS r
        ASOF LEFT JOIN stretch AS s ON r.executor_id = s.executor_id AND r.start_ns >= s.start_ns
        ASOF LEFT JOIN stretch AS e ON r.executor_id = e.executor_id AND r.end_ns >= e.start_ns
    )
),
blocked AS (
    SELECT
        m.callback_instance_id, m.which,
        CASE
            WHEN b.end_ns IS NULL THEN 0
            WHEN m.at_ns >= b.end_ns THEN b.before_ns + b.blocked_ns
            ELSE b.before_ns + m.at_ns - b.start_ns - (m.until_ns - b.start_busy_ns)
        END AS until_ns
    FROM (
        SELECT y.callback_instance_id, y.which, y.at_ns, y.until_ns, e.kind, e.exclusion_id
        FROM busy AS y
        JOIN exclusion AS e ON y.callback_id = e.callback_id
        WHERE has_teams
    ) AS m
    ASOF LEFT JOIN blocking AS b
        ON m.kind = b.kind AND m.exclusion_id = b.exclusion_id AND m.at_ns >= b.start_ns
),
-- With one thread the last wait is over when a callback starts. Since the wait before there is
-- nothing to add up.
drowsy AS MATERIALIZED (
    SELECT callback_instance_id, executor_id, 'earliest' AS which, earliest_ns AS at_ns
    FROM ready
    WHERE earliest_ns IS NOT NULL
        AND (thread_count > 1 OR earliest_ns < wait_start_ns AND earliest_ns < previous_wait_end_ns)
    UNION ALL
    -- What a thread has picked does not wait for work that others wait for.
    SELECT callback_instance_id, executor_id, 'picked', greatest(picked_ns, earliest_ns)
    FROM ready
    WHERE has_teams AND thread_count > 1
),
-- Whether an executor waits at all is looked up where none of its callbacks shows it.
silent AS (SELECT executor_id FROM ready GROUP BY executor_id HAVING max(wait_start_ns) IS NULL),
looked_up AS (
    SELECT executor_id, max(at_ns) AS until_ns FROM drowsy GROUP BY executor_id
    UNION ALL
    SELECT executor_id, 9223372036854775807 FROM silent
),
poll AS MATERIALIZED (
    SELECT executor_id, start_ns, end_ns, before_ns FROM derive.executor_poll('looked_up')
),
idle AS (
    SELECT
        m.callback_instance_id, m.which,
        coalesce(w.before_ns + least(m.at_ns, w.end_ns) - w.start_ns, 0) AS until_ns
    FROM drowsy AS m
    ASOF LEFT JOIN poll AS w ON m.executor_id = w.executor_id AND m.at_ns >= w.start_ns
),
until AS (
    SELECT callback_instance_id, 'busy_' || which AS what, until_ns FROM busy
    UNION ALL
    SELECT callback_instance_id, 'blocked_' || which, until_ns FROM blocked WHERE has_teams
    UNION ALL
    SELECT callback_instance_id, 'idle_' || which, until_ns FROM idle
),
passed AS (
    SELECT
        callback_instance_id,
        max(CASE WHEN what = 'busy_earliest' THEN until_ns END) AS busy_earliest_ns,
        max(CASE WHEN what = 'busy_latest' THEN until_ns END) AS busy_latest_ns,
        max(CASE WHEN what = 'busy_start' THEN until_ns END) AS busy_start_ns,
        max(CASE WHEN what = 'blocked_earliest' THEN until_ns END) AS blocked_earliest_ns,
        max(CASE WHEN what = 'blocked_latest' THEN until_ns END) AS blocked_latest_ns,
        max(CASE WHEN what = 'blocked_start' THEN until_ns END) AS blocked_start_ns,
        max(CASE WHEN what = 'idle_earliest' THEN until_ns END) AS idle_earliest_ns,
        max(CASE WHEN what = 'idle_picked' THEN until_ns END) AS idle_picked_ns
    FROM until
    GROUP BY callback_instance_id
),
waiting AS (
    SELECT executor_id FROM ready WHERE wait_start_ns IS NOT NULL
    UNION
    SELECT executor_id FROM poll
),
measured AS (
    SELECT
        r.run_id, r.executor_id, r.thread_id, r.callback_id, r.callback_instance_id, r.since,
        r.origin_ns, r.earliest_ns, r.latest_ns, r.start_ns, r.is_loss_affected,
        coalesce(r.start_busy_ns, p.busy_start_ns) AS busy_start_ns,
        coalesce(r.earliest_busy_ns, p.busy_earliest_ns) AS busy_earliest_ns,
        coalesce(r.latest_busy_ns, p.busy_latest_ns) AS busy_latest_ns,
        coalesce(p.blocked_start_ns - p.blocked_latest_ns, 0) AS blocked_min_ns,
        coalesce(p.blocked_start_ns - p.blocked_earliest_ns, 0) AS blocked_max_ns,
        CASE
            WHEN w.executor_id IS NULL OR r.earliest_ns IS NULL THEN NULL
            WHEN r.thread_count > 1 THEN p.idle_picked_ns - p.idle_earliest_ns
            WHEN r.wait_start_ns IS NULL OR r.earliest_ns >= r.wait_end_ns THEN 0
            WHEN r.earliest_ns >= r.wait_start_ns THEN r.wait_end_ns - r.earliest_ns
            ELSE r.wait_end_ns - r.wait_start_ns
                + coalesce(r.wait_before_ns - p.idle_earliest_ns, 0)
        END AS idle_ns,
        r.thread_count,
        -- From the end of one wait to the begin of the next, which found the input.
        CASE WHEN r.thread_count = 1 AND r.earliest_ns IS NOT NULL AND NOT r.is_loss_affected
            THEN r.wait_start_ns - greatest(r.earliest_ns, r.previous_wait_end_ns) END AS away_ns
    FROM ready AS r
    LEFT JOIN passed AS p ON r.callback_instance_id = p.callback_instance_id
    LEFT JOIN waiting AS w ON r.executor_id = w.executor_id
)
SELECT
    r.run_id, r.callback_instance_id, r.executor_id, r.thread_id, r.callback_id, r.since,
    derive.corrected_ns(r.origin_ns, c) AS origin_ns,
    derive.corrected_ns(r.earliest_ns, c) AS earliest_ns,
    derive.corrected_ns(r.latest_ns, c) AS latest_ns,
    derive.corrected_ns(r.start_ns, c) AS start_ns,
    r.start_ns - r.origin_ns AS wait_ns,
    r.busy_start_ns - r.busy_latest_ns + r.blocked_min_ns AS busy_min_ns,
    r.busy_start_ns - r.busy_earliest_ns + r.blocked_max_ns AS busy_max_ns,
    CASE WHEN r.earliest_ns IS NOT NULL THEN r.blocked_max_ns END AS blocked_max_ns,
    r.idle_ns, r.is_loss_affected,
    -- An excluded callback may wait while a thread is idle: then more was held than this says.
    CASE WHEN r.thread_count > 1 AND r.idle_ns IS NOT NULL THEN greatest(
        r.start_ns - r.earliest_ns - r.idle_ns
        - (r.busy_start_ns - r.busy_earliest_ns + r.blocked_max_ns),
        0
    )
        -- Less is what an executor does between two waits anyway.
        WHEN r.away_ns - (r.busy_latest_ns - r.busy_earliest_ns) >= 1_000_000
            THEN r.away_ns - (r.busy_latest_ns - r.busy_earliest_ns)
    END AS held_max_ns
FROM measured AS r
JOIN store.thread AS t ON r.thread_id = t.thread_id
JOIN derive.process_clock AS c ON t.process_id = c.process_id
