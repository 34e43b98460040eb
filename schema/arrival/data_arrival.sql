-- description: When messages arrived before they were taken. The listener of the middleware says so
--     (CARET, with Fast DDS): the first time that its process had one of that stamp. With several
--     readers in the process it is not known which of them had it then. In an events executor, the
--     queue has what its own thread publishes when publish() has returned; of other messages, a
--     kernel trace shows how the publishing thread woke the middleware's.
-- grain: one row per take whose message is known to have arrived
-- when: raw.ros2_caret_on_data_available, staging.executor WHERE kind = 'events'

-- When ROS threads woke the middleware's threads that wake the threads of events executors: how
-- messages come to their process while these run. By their names, these are threads of the
-- middleware.
-- when: staging.thread_waking
-- columns: process_id BIGINT, waker_thread_id BIGINT, at_ns BIGINT
CREATE OR REPLACE TEMP TABLE middleware_waking AS
WITH receiver AS (
    SELECT DISTINCT
        t.process_id, w.clock_key,
        w.waker_tid AS tid
    FROM staging.thread_waking AS w
    JOIN staging.thread AS t ON w.thread_id = t.thread_id
    JOIN staging.executor_thread AS x ON t.thread_id = x.thread_id
    JOIN staging.executor AS e ON x.executor_id = e.executor_id
    WHERE e.kind = 'events' AND regexp_matches(w.waker_name, '^(dds\.|recv|dq\.)')
)
SELECT
    r.process_id,
    p.thread_id AS waker_thread_id,
    k.ts_ns + s.shift_ns AS at_ns
FROM raw.sched_waking AS k
JOIN staging.schedule AS s ON k.trace_index = s.trace_index
JOIN receiver AS r ON s.clock_key = r.clock_key AND k.tid = r.tid
JOIN raw.sched_switch AS w ON k.switch_event_id = w.event_id
JOIN staging.thread_tid AS p ON staging.has_tid(p, s.clock_key, w.next_tid, k.ts_ns + s.shift_ns)
WHERE s.is_joined AND k.interrupt IS NULL;

WITH heard AS (
    SELECT
        n.take_id,
        t.taken_ns - min(a.ts_ns) AS waited_ns,
        count(*) > 1 AS is_ambiguous
    FROM staging.located('raw.ros2_caret_on_data_available') AS a
    JOIN staging.take_chain AS t
        ON a.process_id = t.process_id AND a.source_stamp = t.source_timestamp_ns
    JOIN staging.take_number AS n ON t.start_event_id = n.start_event_id
    WHERE a.event_id < t.start_event_id
    GROUP BY n.take_id, t.taken_ns
),
queued AS (
    SELECT m.*
    FROM staging.queued_message AS m
    JOIN staging.executor_thread AS x ON m.thread_id = x.thread_id
    JOIN staging.executor AS e ON x.executor_id = e.executor_id
    ANTI JOIN heard AS h ON m.take_id = h.take_id
    WHERE e.kind = 'events'
)
SELECT take_id, waited_ns, is_ambiguous FROM heard
UNION ALL
SELECT
    take_id,
    taken_ns - least(next_ns, taken_ns),
    false
FROM queued
WHERE publishing_thread_id = thread_id
UNION ALL
-- The last one: before, it may wait for what the publishing thread still holds.
SELECT
    m.take_id,
    m.taken_ns - max(w.at_ns),
    false
FROM queued AS m
JOIN middleware_waking AS w
    ON m.process_id = w.process_id
    AND m.publishing_thread_id = w.waker_thread_id
    AND w.at_ns >= m.published_ns
    AND w.at_ns < coalesce(least(m.next_ns, m.taken_ns), m.taken_ns)
WHERE m.publishing_thread_id <> m.thread_id
GROUP BY m.take_id, m.taken_ns
