-- description: Callback instances with their extent and nesting. Plain is a begin whose end is the
--     next begin or end of any callback on its thread, with no gap between; most are. Of those left
--     over, a begin is paired with the next event of the same callback on its thread, if that is an
--     end. Ends that are still left over (recursion) belong to the latest begin left over (a
--     callback that spins and is called again). This is repeated until nothing pairs. Nothing pairs
--     across a gap. `depth` counts from 1, `parent_event_id` is the begin of the instance around.
--     Three columns say what comes before the begin on its thread: of calls (`previous_event_id`,
--     not across a gap), of callbacks, and of the executor. `executor_event_id` is the last of
--     these, but not across a gap. `effective_end_event_id`: where one that was never seen to end
--     is over for what is inside it.
-- grain: one row per callback_start
-- when: raw.ros2_callback_start

-- How many gaps threads had seen at each begin and end of a callback, where they saw any at all.
-- when: staging.near_gap WHERE sequence = 'call' AND is_between
-- columns: event_id BIGINT, segment BIGINT
CREATE OR REPLACE TEMP TABLE callback_segment AS
WITH gap AS (
    SELECT
        event_id, thread_id,
        row_number() OVER (PARTITION BY thread_id ORDER BY event_id) AS segment
    FROM staging.near_gap
    WHERE sequence = 'call' AND is_between
),
event AS (
    SELECT event_id, thread_index FROM raw.ros2_callback_start
    UNION ALL
    SELECT event_id, thread_index FROM raw.ros2_callback_end
),
located AS (FROM staging.located('event') WHERE thread_id IN (SELECT thread_id FROM gap))
SELECT e.event_id, g.segment
FROM located AS e
ASOF JOIN gap AS g ON e.thread_id = g.thread_id AND e.event_id >= g.event_id;

CREATE OR REPLACE TEMP TABLE callback_plain AS
SELECT
    s.event_id AS start_event_id,
    e.event_id AS end_event_id,
    s.ts_ns AS start_ns,
    e.ts_ns AS end_ns,
    s.trace_index, c.thread_id, c.process_id,
    s.callback AS callback_handle,
    coalesce(s.is_intra_process = 1, false) AS is_intra_process,
    CASE WHEN g.event_id IS NULL THEN s.previous_call_event_id END AS previous_event_id,
    s.previous_callback_event_id, s.previous_executor_event_id,
    CASE WHEN x.event_id IS NULL THEN s.previous_executor_event_id END AS executor_event_id
FROM raw.ros2_callback_start AS s
JOIN raw.ros2_callback_end AS e
    ON s.event_id = e.previous_callback_event_id AND s.callback = e.callback
JOIN staging.thread AS c
    ON s.thread_index = c.thread_index
    AND s.event_id >= c.from_event_id
    AND e.event_id < c.until_event_id
LEFT JOIN callback_segment AS m ON s.event_id = m.event_id
LEFT JOIN callback_segment AS n ON e.event_id = n.event_id
LEFT JOIN (SELECT event_id FROM staging.near_gap WHERE sequence = 'call' AND is_behind) AS g
    ON s.event_id = g.event_id
LEFT JOIN (SELECT event_id FROM staging.near_gap WHERE sequence = 'executor' AND is_behind) AS x
    ON s.event_id = x.event_id
WHERE m.segment IS NOT DISTINCT FROM n.segment;

-- Begins and ends that are not plain, each with its partner, or NULL.
CREATE OR REPLACE TEMP TABLE callback_left_over AS
WITH RECURSIVE event AS (
    SELECT
        s.event_id, s.ts_ns, s.trace_index, s.thread_index,
        s.callback AS callback_handle,
        true AS is_start,
        coalesce(s.is_intra_process = 1, false) AS is_intra_process,
        s.previous_call_event_id, s.previous_callback_event_id, s.previous_executor_event_id
    FROM raw.ros2_callback_start AS s
    ANTI JOIN callback_plain AS p ON s.event_id = p.start_event_id
    UNION ALL
    SELECT
        e.event_id, e.ts_ns, e.trace_index, e.thread_index, e.callback, false, false,
        e.previous_call_event_id, e.previous_callback_event_id, NULL
    FROM raw.ros2_callback_end AS e
    ANTI JOIN callback_plain AS p ON e.event_id = p.end_event_id
),
callback_event AS MATERIALIZED (
    SELECT
        e.event_id, e.ts_ns, e.trace_index, e.thread_id, e.process_id, e.callback_handle,
        e.is_start, e.is_intra_process,
        CASE WHEN c.event_id IS NULL THEN e.previous_call_event_id END AS previous_event_id,
        e.previous_callback_event_id, e.previous_executor_event_id,
        CASE WHEN x.event_id IS NULL THEN e.previous_executor_event_id END AS executor_event_id,
        coalesce(i.segment, 0) AS segment
    FROM staging.located('event') AS e
    LEFT JOIN callback_segment AS i ON e.event_id = i.event_id
    LEFT JOIN (SELECT event_id FROM staging.near_gap WHERE sequence = 'call' AND is_behind) AS c
        ON e.event_id = c.event_id
    LEFT JOIN (SELECT event_id FROM staging.near_gap WHERE sequence = 'executor' AND is_behind) AS x
        ON e.event_id = x.event_id
),
left_over AS (
    SELECT
        0 AS pass, event_id, thread_id, callback_handle, segment, is_start, ts_ns,
        NULL::BIGINT AS partner_event_id,
        NULL::BIGINT AS partner_ns
    FROM callback_event
    UNION ALL
    SELECT
        pass, event_id, thread_id, callback_handle, segment, is_start, ts_ns, partner_event_id,
        partner_ns
    FROM (
        SELECT
            pass + 1 AS pass,
            event_id, thread_id, callback_handle, segment, is_start, ts_ns,
            CASE
                WHEN is_start AND NOT lead(is_start) OVER same THEN lead(event_id) OVER same
                WHEN NOT is_start AND lag(is_start) OVER same THEN lag(event_id) OVER same
            END AS partner_event_id,
            CASE WHEN is_start AND NOT lead(is_start) OVER same THEN lead(ts_ns) OVER same END
                AS partner_ns
        FROM left_over
        WHERE partner_event_id IS NULL
        WINDOW same AS (PARTITION BY thread_id, callback_handle, segment ORDER BY event_id)
    )
    QUALIFY bool_or(partner_event_id IS NOT NULL) OVER ()
),
paired AS (
    SELECT
        event_id,
        max(partner_event_id) AS partner_event_id,
        max(partner_ns) AS partner_ns
    FROM left_over
    GROUP BY event_id
)
SELECT e.*, p.partner_event_id, p.partner_ns
FROM callback_event AS e
JOIN paired AS p ON e.event_id = p.event_id;

-- Others may be inside an instance that has a begin or an end of a callback before its own end, and
-- inside one that was never seen to end. The latter lasts, for what is inside it, until the first
-- event of its thread that cannot be inside: the next begin or end of a callback, an executor
-- event, or an event behind a gap of any CPU. On other threads none is nested.
-- when: callback_left_over
-- columns: start_event_id BIGINT, effective_end_event_id BIGINT, depth INTEGER, parent_event_id
--     BIGINT
CREATE OR REPLACE TEMP TABLE callback_nesting AS
WITH never_ended AS MATERIALIZED (
    SELECT
        event_id AS start_event_id,
        thread_id, previous_executor_event_id
    FROM callback_left_over
    WHERE is_start AND partner_event_id IS NULL
),
closed_by AS (
    SELECT
        o.start_event_id,
        min(e.event_id) AS event_id
    FROM never_ended AS o
    JOIN (
        SELECT event_id, thread_id, previous_callback_event_id FROM callback_left_over
        UNION ALL
        SELECT start_event_id, thread_id, previous_callback_event_id FROM callback_plain
    ) AS e
        ON o.start_event_id = e.previous_callback_event_id AND o.thread_id = e.thread_id
    GROUP BY o.start_event_id
    UNION ALL
    SELECT
        o.start_event_id,
        min(x.event_id)
    FROM never_ended AS o
    JOIN staging.executor_event AS x
        ON o.previous_executor_event_id = x.previous_event_id
        AND o.thread_id = x.thread_id
        AND x.event_id > o.start_event_id
    GROUP BY o.start_event_id
    UNION ALL
    SELECT o.start_event_id, x.event_id
    FROM never_ended AS o
    JOIN staging.executor_first AS x ON o.thread_id = x.thread_id AND x.event_id > o.start_event_id
    UNION ALL
    SELECT o.start_event_id, g.event_id
    FROM never_ended AS o
    ASOF JOIN (SELECT * FROM staging.near_gap WHERE sequence = 'call') AS g
        ON o.thread_id = g.thread_id AND o.start_event_id < g.event_id
),
effective_end AS (
    SELECT
        start_event_id,
        min(event_id) AS event_id
    FROM closed_by
    GROUP BY start_event_id
),
outer_run AS MATERIALIZED (
    SELECT
        p.event_id AS start_event_id,
        p.thread_id,
        coalesce(p.partner_event_id, e.event_id, t.last_event_id + 1) AS effective_end_event_id
    FROM callback_left_over AS p
    JOIN staging.thread AS t ON p.thread_id = t.thread_id
    LEFT JOIN effective_end AS e ON p.event_id = e.start_event_id
    WHERE p.is_start
),
edge AS (
    SELECT
        thread_id,
        start_event_id AS event_id,
        1 AS step
    FROM outer_run
    UNION ALL
    SELECT thread_id, effective_end_event_id, -1
    FROM outer_run
),
level AS (
    SELECT
        thread_id, event_id,
        (sum(sum(step)) OVER (PARTITION BY thread_id ORDER BY event_id))::INTEGER AS depth
    FROM edge
    GROUP BY thread_id, event_id
),
started AS (
    SELECT
        start_event_id, thread_id,
        false AS is_plain
    FROM outer_run
    UNION ALL
    SELECT start_event_id, thread_id, true
    FROM callback_plain
    WHERE thread_id IN (SELECT thread_id FROM outer_run)
),
nested AS (
    SELECT
        s.start_event_id, s.thread_id, s.is_plain,
        coalesce(l.depth, 0) + s.is_plain::INTEGER AS depth
    FROM started AS s
    ASOF LEFT JOIN level AS l ON s.thread_id = l.thread_id AND s.start_event_id >= l.event_id
)
SELECT
    i.start_event_id, e.effective_end_event_id, i.depth,
    o.start_event_id AS parent_event_id
FROM nested AS i
LEFT JOIN outer_run AS e ON i.start_event_id = e.start_event_id
ASOF LEFT JOIN (SELECT * FROM nested WHERE NOT is_plain) AS o
    ON i.thread_id = o.thread_id AND i.depth - 1 = o.depth AND i.start_event_id > o.start_event_id;

WITH pair AS (
    SELECT
        *,
        true AS is_plain
    FROM callback_plain
    UNION ALL BY NAME
    SELECT
        event_id AS start_event_id,
        partner_event_id AS end_event_id,
        ts_ns AS start_ns,
        partner_ns AS end_ns,
        trace_index, thread_id, process_id, callback_handle, is_intra_process, previous_event_id,
        previous_callback_event_id, previous_executor_event_id, executor_event_id,
        false AS is_plain
    FROM callback_left_over
    WHERE is_start
)
SELECT
    p.*,
    coalesce(p.end_event_id, n.effective_end_event_id) AS effective_end_event_id,
    coalesce(n.depth, 1) AS depth,
    n.parent_event_id,
    p.start_event_id IN (SELECT event_id FROM raw.agnocast_agnocast_callable_start) AS is_agnocast
FROM pair AS p
LEFT JOIN callback_nesting AS n ON p.start_event_id = n.start_event_id
