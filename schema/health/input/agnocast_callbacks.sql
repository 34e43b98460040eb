-- title: Callbacks of Agnocast, whose executors record no events
-- description: Messages and timers of Agnocast led to callbacks. They are followed as those of ROS
--     2 are. But what threads of Agnocast did between callbacks is not known: they have no executor
--     states, and how long a message waited for them is bounded by callbacks only.
-- cause: Executors of Agnocast have no tracepoints while they wait and select.
-- cure: None needed.
-- grain: one row per process with such callbacks
-- severity: info
-- when: staging.callback_run WHERE is_agnocast
SELECT
    p.process_id,
    count(*) AS count,
    printf('%d callbacks on %d threads', count(*), count(DISTINCT p.thread_id)) AS detail
FROM staging.callback_run AS p
WHERE p.is_agnocast
GROUP BY p.process_id
