-- description: Pairs of sessions that recorded the same ids of threads at the same time, and
--     whether these are the same threads: then most events that one of them recorded while both
--     did have a twin in the other.
-- grain: one row per pair of sessions, the earlier one first
-- param: twin_ns BIGINT  Most time between an event and its twin
-- column: left_session BIGINT  The earlier session
-- column: right_session BIGINT  The later session
-- column: is_same BOOLEAN  They recorded the same threads
-- when: temp.overlap_window
WITH recorded AS (
    SELECT
        thread, tracepoint, session,
        min(ts_ns) - $twin_ns AS first_ns,
        max(ts_ns) + $twin_ns AS last_ns
    FROM session_event
    GROUP BY thread, tracepoint, session
),
common AS (
    SELECT
        l.thread, l.tracepoint,
        l.session AS left_session,
        r.session AS right_session,
        greatest(l.first_ns, r.first_ns) AS from_ns,
        least(l.last_ns, r.last_ns) AS until_ns
    FROM recorded AS l
    JOIN recorded AS r
        ON l.thread = r.thread AND l.tracepoint = r.tracepoint AND l.session < r.session
),
event AS (
    SELECT
        c.left_session, c.right_session, e.session, e.thread, e.tracepoint, e.ts_ns,
        coalesce(e.cpu_id, -1) AS cpu_id
    FROM common AS c
    JOIN session_event AS e
        ON c.thread = e.thread
        AND c.tracepoint = e.tracepoint
        AND e.session IN (c.left_session, c.right_session)
        AND e.ts_ns >= c.from_ns
        AND e.ts_ns <= c.until_ns
),
compared AS (
    SELECT
        l.left_session, l.right_session, l.thread, l.tracepoint,
        count(*) AS left_count,
        count(*) FILTER (l.ts_ns - r.ts_ns <= $twin_ns) AS twin_count
    FROM (FROM event WHERE session = left_session) AS l
    ASOF LEFT JOIN (FROM event WHERE session = right_session) AS r
        -- The twins that a session has are the same in each pair.
        ON l.right_session = r.right_session
        AND l.thread = r.thread
        AND l.tracepoint = r.tracepoint
        AND l.cpu_id = r.cpu_id
        AND l.ts_ns + $twin_ns >= r.ts_ns
    GROUP BY l.left_session, l.right_session, l.thread, l.tracepoint
),
right_counted AS (
    SELECT
        left_session, right_session, thread, tracepoint,
        count(*) AS right_count
    FROM event
    WHERE session = right_session
    GROUP BY left_session, right_session, thread, tracepoint
)
SELECT
    l.left_session, l.right_session,
    -- Where one of them lost events, those of the other have no twins.
    2 * sum(l.twin_count) >= sum(least(l.left_count, r.right_count))
        AS is_same
FROM compared AS l
JOIN right_counted AS r
    ON l.left_session = r.left_session
    AND l.right_session = r.right_session
    AND l.thread = r.thread
    AND l.tracepoint = r.tracepoint
GROUP BY l.left_session, l.right_session
