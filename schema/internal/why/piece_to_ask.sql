-- title: What can be asked about the longest piece of a slow flow
-- description: Names in the longest piece of a flow, each in the column of the command that takes
--     it. What the trace has no name for cannot be asked for.
-- grain: one row per flow
-- next: query scheduling --measure {measure}
--     | query callbacks --each --slowest 5 --node {running_node}
--     | query waits --by instance --slowest 5 --node {waiting_node}
--     | query timers --node {timer_node} | query service-latency --node {calling_node}
--     | query topics --measure latency --topic {topic_name}
-- reads: piece
-- column: measure VARCHAR  What the kernel's scheduler shows of it: 'preemption' or 'wakeup'
-- column: running_node VARCHAR  Node whose callback ran
-- column: waiting_node VARCHAR  Node whose callback waited for its executor
-- column: timer_node VARCHAR  Node that waited for its timer
-- column: calling_node VARCHAR  Node that called a service
-- column: topic_name VARCHAR  Topic of a message that was on the way, or waited
WITH longest AS (
    SELECT
        state, activity, callback_instance_id,
        nullif(node, '?') AS node,
        nullif(what, '?') AS topic_name
    FROM (
        SELECT
            *,
            row_number() OVER () AS place
        FROM piece
    )
    ORDER BY duration_ns DESC, place
    LIMIT 1
)
SELECT
    CASE state WHEN 'preempted' THEN 'preemption' WHEN 'runnable' THEN 'wakeup' END AS measure,
    CASE
        WHEN activity = 'callback' AND callback_instance_id IS NOT NULL THEN node
    END AS running_node,
    CASE
        WHEN activity IN (
            'executor_busy', 'all_threads_busy', 'blocked', 'undecided', 'take_to_callback'
        ) AND callback_instance_id IS NOT NULL THEN node
    END AS waiting_node,
    CASE WHEN activity = 'timer' THEN node END AS timer_node,
    CASE WHEN activity = 'service' THEN node END AS calling_node,
    CASE WHEN activity IN ('network_or_idle', 'undecided') THEN topic_name END AS topic_name
FROM longest
