-- description: The clock of each kernel trace: the one by which most events of ROS processes
--     happened while the kernel says that their thread ran on their CPU. A thread has one number
--     until its process initialises ROS again, and no other thread has that meanwhile: any other
--     one counts as contradiction. Where the kernel trace contradicts itself, events do not count;
--     where it does so at nearly all, the few others may agree by chance. With the right clock all
--     events agree. 5 us beside it 2 to 47 % do not, but candidates are much further apart. Events
--     are counted, those that agree, and those at which the kernel trace contradicts itself
--     (`unknown_count`). `shift_ns` has to be added to its times. A trace is placed at this clock,
--     and at the host of that name there, unless it names a clock that a ROS process has. One of
--     perf that no schedule proves is of the only clock there is.
-- grain: one row per kernel trace with switches
-- when: staging.schedule_candidate
WITH thread AS (
    SELECT
        thread_index, trace_index,
        coalesce(pid_ns, 0) AS pid_ns,
        vpid, vtid
    FROM raw.thread
),
life AS (
    SELECT
        t.thread_index,
        i.event_id AS from_event_id
    FROM raw.ros2_rcl_init AS i
    JOIN thread AS o ON i.thread_index = o.thread_index
    JOIN thread AS t ON o.trace_index = t.trace_index AND o.pid_ns = t.pid_ns AND o.vpid = t.vpid
),
-- Few and narrow columns: all moments are sorted.
lived AS (
    SELECT
        m.candidate_number, m.thread_index,
        l.from_event_id AS life,
        m.tid, m.is_known, m.at_ns
    FROM (
        SELECT
            candidate_number, thread_index, event_id, tid, at_ns,
            contradiction_id IS NULL AS is_known
        FROM staging.schedule_moment
    ) AS m
    ASOF LEFT JOIN life AS l ON m.thread_index = l.thread_index AND m.event_id >= l.from_event_id
),
moment AS (
    SELECT
        candidate_number, thread_index, life, tid,
        count(*) FILTER (is_known) AS event_count,
        count(*) FILTER (NOT is_known) AS unknown_count,
        min(at_ns) FILTER (is_known) AS first_ns,
        max(at_ns) FILTER (is_known) AS last_ns
    FROM lived
    GROUP BY ALL
),
ran AS (
    SELECT
        m.*,
        (t.pid_ns, t.vpid, t.vtid) AS ids
    FROM moment AS m
    JOIN thread AS t ON m.thread_index = t.thread_index
),
-- A trace of a process has an index of its own for the same thread.
held AS (
    SELECT
        candidate_number, ids, life, tid,
        sum(event_count) AS event_count,
        min(first_ns) AS first_ns,
        max(last_ns) AS last_ns
    FROM ran
    WHERE tid <> 0
    GROUP BY ALL
),
-- The kernel gives a number again when its thread has ended.
owner AS (
    SELECT h.*
    FROM held AS h
    WHERE NOT EXISTS (
        SELECT 1
        FROM held AS o
        WHERE o.candidate_number = h.candidate_number
            AND o.tid = h.tid
            AND o.ids <> h.ids
            AND (o.event_count, o.ids) > (h.event_count, h.ids)
            AND o.first_ns <= h.last_ns
            AND o.last_ns >= h.first_ns
    )
),
most AS (
    SELECT
        r.candidate_number,
        sum(r.event_count) AS event_count,
        coalesce(max(r.event_count) FILTER (WHERE o.tid IS NOT NULL), 0) AS agreeing_count,
        sum(r.unknown_count) AS unknown_count
    FROM ran AS r
    LEFT JOIN owner AS o
        ON r.candidate_number = o.candidate_number
        AND r.tid = o.tid
        AND r.ids = o.ids
        AND r.life IS NOT DISTINCT FROM o.life
    GROUP BY r.candidate_number, r.thread_index, r.life
),
agreement AS (
    SELECT
        candidate_number,
        sum(event_count)::BIGINT AS event_count,
        sum(agreeing_count)::BIGINT AS agreeing_count,
        sum(unknown_count)::BIGINT AS unknown_count
    FROM most
    GROUP BY ALL
),
best AS (
    SELECT
        c.candidate_number, c.trace_index, c.clock_key, c.shift_ns,
        coalesce(a.event_count, 0) AS event_count,
        coalesce(a.agreeing_count, 0) AS agreeing_count,
        coalesce(a.unknown_count, 0) AS unknown_count,
        coalesce(
            a.event_count >= 0.05 * (a.event_count + a.unknown_count)
            AND a.agreeing_count >= 0.95 * a.event_count,
            false
        ) AS is_joined,
        c.has_cpus
    FROM staging.schedule_candidate AS c
    LEFT JOIN agreement AS a ON c.candidate_number = a.candidate_number
    -- A few events agree with a wrong clock, too.
    QUALIFY row_number() OVER (
        PARTITION BY c.trace_index
        ORDER BY is_joined DESC, a.agreeing_count DESC NULLS LAST, c.clock_key, abs(c.shift_ns)
    ) = 1
),
placed AS (
    SELECT
        *,
        is_joined OR (
            SELECT count(DISTINCT clock_key) = 1
            FROM staging.source
            WHERE domain IS DISTINCT FROM 'kernel'
        ) AS is_placed
    FROM best
)
SELECT
    p.*,
    CASE WHEN p.is_placed THEN p.clock_key ELSE s.clock_key END AS placed_clock_key,
    CASE WHEN p.is_placed AND s.hostname NOT IN (
        SELECT hostname FROM staging.source AS o WHERE o.clock_key = p.clock_key
    ) THEN (
        SELECT arg_min(hostname, trace_index)
        FROM staging.source AS o
        WHERE o.clock_key = p.clock_key AND o.domain IS DISTINCT FROM 'kernel'
    ) ELSE s.hostname END AS placed_hostname,
    CASE WHEN p.is_joined THEN p.shift_ns ELSE 0 END AS placed_shift_ns
FROM placed AS p
JOIN staging.source AS s ON p.trace_index = s.trace_index
