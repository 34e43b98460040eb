-- title: Processes had equal ids at one time
-- description: Processes had the same ids at the same time. They are told apart by their names, or
--     by the sessions that recorded them. A thread with a name that no main thread has belongs
--     to no known process.
-- cause: Containers number their processes alike, and share a session daemon, or a hostname.
-- cure: None needed if the processes below are those that ran. To be sure, record the namespace of
--     the ids: lttng add-context -u -t pid_ns.
-- grain: one row, if there are any
-- severity: info
-- when: staging.process WHERE pid_namespace < 0
SELECT
    count(*) AS count,
    'processes with ids that others had as well: '
    || string_agg(l.label, ', ' ORDER BY l.process_id) AS detail
FROM process_label AS l
JOIN staging.process AS p ON l.process_id = p.process_id
WHERE p.pid_namespace < 0
HAVING count(*) > 0
