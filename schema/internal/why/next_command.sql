-- description: Commands that show more of an explanation, as words behind msgflow. They are about
--     what the path lacks, the longest piece (`piece`) of its slow flow, that flow, and messages
--     that were lost (`loss`). What the trace has no name for cannot be asked for.
-- grain: one row per command
-- reads: loss, piece
-- param: has_unknown BOOLEAN  The path lacks links, or names
-- param: since VARCHAR[]      Options that leave out a warm-up
WITH placed AS (SELECT *, row_number() OVER () AS place FROM piece),
longest AS (
    SELECT
        state, activity, callback_instance_id,
        nullif(node, '?') AS node,
        nullif(what, '?') AS topic
    FROM placed
    ORDER BY duration_ns DESC, place
    LIMIT 1
),
command AS (
    SELECT 1 AS place, ['suggest', 'links'] AS words WHERE $has_unknown
    UNION ALL
    SELECT
        2,
        CASE
            WHEN state = 'preempted' THEN ['query', 'scheduling', '--measure', 'preemption']
            WHEN state = 'runnable' THEN ['query', 'scheduling', '--measure', 'wakeup']
            WHEN activity = 'callback' AND node IS NOT NULL AND callback_instance_id IS NOT NULL
                THEN ['query', 'callbacks', '--each', '--slowest', '5', '--node', node]
            WHEN activity IN (
                    'executor_busy', 'all_threads_busy', 'blocked', 'undecided', 'take_to_callback'
                ) AND node IS NOT NULL AND callback_instance_id IS NOT NULL
                THEN ['query', 'waits', '--by', 'instance', '--slowest', '5', '--node', node]
            WHEN activity = 'timer' AND node IS NOT NULL THEN ['query', 'timers', '--node', node]
            WHEN activity = 'service' AND node IS NOT NULL
                THEN ['query', 'service-latency', '--node', node]
            WHEN activity IN ('network_or_idle', 'undecided') AND topic IS NOT NULL
                THEN ['query', 'topics', '--measure', 'latency', '--topic', topic]
        END || $since::VARCHAR[]
    FROM longest
    UNION ALL
    SELECT 3, ['flow', '--take', take_id::VARCHAR, '--why'] FROM placed WHERE place = 1
    UNION ALL
    SELECT
        4,
        ['query', 'topics', '--measure', 'unmatched'] || CASE
            WHEN count(*) = count(topic_name)
                THEN flatten(list(['--topic', topic_name] ORDER BY topic_name))
            ELSE []
        END
    FROM (SELECT DISTINCT topic_name FROM loss)
    HAVING count(*) > 0
)
SELECT words
FROM command
WHERE words IS NOT NULL
ORDER BY place
