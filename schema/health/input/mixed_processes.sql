-- title: Processes with equal ids cannot be told apart
-- description: Several processes have the same ids and names, and their events are mixed. A thread
--     was on two CPUs at one moment. Or Fast DDS made the GIDs of publishers and subscriptions in
--     several processes, and these took turns. Each such mixture is one process here. Its objects,
--     callbacks and executors may be those of any of them, all its links between messages and
--     callbacks have a candidate_count above 1, and flows do not pass its callbacks. A mixture may
--     show neither sign, as with another middleware on one CPU.
-- cause: Containers number their processes alike, and share a session daemon, or a hostname. Or the
--     session lacks the ids of processes and threads.
-- cure: Record the ids and their namespace (lttng add-context -u -t vpid -t vtid -t pid_ns), or
--     start a session daemon in each container and give each a hostname.
-- grain: one row, if there are any
-- severity: error
-- when: staging.process WHERE is_ambiguous
SELECT
    count(*) AS count,
    'processes that are several with equal ids: '
    || string_agg(l.label, ', ' ORDER BY l.process_id) AS detail
FROM process_label AS l
JOIN staging.process AS p ON l.process_id = p.process_id
WHERE p.is_ambiguous
HAVING count(*) > 0
