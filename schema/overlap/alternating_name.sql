-- description: Names of processes that run at the same time under one id. A thread that has such
--     a name gets it back after another one. A thread that renames itself does so inside of
--     callbacks, too: one that begins under a name and ends under another is of one process. A
--     thread that initialises ROS may be of a further life of the id: names from before do not
--     count.
-- grain: one row per host, pid and name
-- column: host BIGINT  The host
-- column: vpid INTEGER  The pid
-- column: procname VARCHAR  The name
-- when: raw.thread_name WHERE thread_index IN (SELECT thread_index FROM raw.thread_name
--     GROUP BY thread_index HAVING count(*) > 2)
WITH named AS (
    SELECT
        s.host, r.vpid, r.thread_index, n.procname, n.first_event_id,
        i.event_id AS initialised_event_id,
        lag(n.procname) OVER (
            PARTITION BY n.thread_index ORDER BY n.first_event_id
        ) IS DISTINCT FROM n.procname AS is_other
    FROM raw.thread_name AS n
    ASOF LEFT JOIN raw.ros2_rcl_init AS i
        ON n.thread_index = i.thread_index AND n.first_event_id >= i.event_id
    JOIN raw.thread AS r ON n.thread_index = r.thread_index
    JOIN session_trace AS s ON r.trace_index = s.trace_index
    WHERE r.pid_ns IS NULL AND n.procname IS NOT NULL
),
alternating AS MATERIALIZED (
    SELECT host, vpid, thread_index
    FROM named
    GROUP BY host, vpid, thread_index, initialised_event_id
    HAVING count(*) FILTER (is_other) > count(DISTINCT procname)
),
renamed AS (
    SELECT a.host, a.vpid
    FROM alternating AS a
    JOIN raw.ros2_callback_end AS e ON a.thread_index = e.thread_index
    -- Most recordings have no such thread, and their callbacks are not read.
    JOIN (
        FROM raw.ros2_callback_start
        WHERE thread_index IN (SELECT thread_index FROM alternating)
    ) AS b
        ON e.previous_callback_event_id = b.event_id AND e.callback = b.callback
    ASOF JOIN named AS f ON b.thread_index = f.thread_index AND b.event_id >= f.first_event_id
    ASOF JOIN named AS l ON e.thread_index = l.thread_index AND e.event_id >= l.first_event_id
    WHERE f.procname <> l.procname
)
SELECT DISTINCT n.host, n.vpid, n.procname
FROM named AS n
SEMI JOIN alternating AS a ON n.thread_index = a.thread_index
ANTI JOIN renamed AS r ON n.host = r.host AND n.vpid = r.vpid
