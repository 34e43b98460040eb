-- description: What took longest of a flow, in words: two pieces at most of its critical path,
--     which it reads as `piece`. One that took less than a fifth of the latency is not to blame.
-- grain: one row; NULL: nothing is to blame
-- reads: piece
-- param: path VARCHAR  Nodes and topics of the requirement: rclpy does not record its callbacks,
--     but which node sends a message is known
WITH slowest AS (
    SELECT *
    FROM (
        SELECT
            *,
            row_number() OVER () AS place
        FROM piece
    )
    ORDER BY duration_ns DESC, place
    LIMIT 2
),
named AS (
    SELECT
        duration_ns, place, activity, state,
        wakers > 0 AS is_woken,
        coalesce(
            node, if(hop > 0, string_split($path, ' → ')[2 * hop - 1], NULL), 'an unknown node'
        ) AS node,
        coalesce(what, 'a message') AS what,
        coalesce(who, 'another thread') AS who,
        main.duration_text(duration_ns) AS time
    FROM slowest
    WHERE activity <> 'rest' AND share >= 0.2
)
SELECT
    string_agg(
        CASE activity
            WHEN 'callback' THEN
                CASE
                    WHEN is_woken THEN printf('%s waited %s for %s', node, time, who)
                    -- Of its thread, where the kernel was traced.
                    WHEN state = 'preempted'
                        THEN printf('%s waited %s for a CPU that %s had', node, time, who)
                    WHEN state = 'runnable' THEN printf('%s waited %s for a CPU', node, time)
                    WHEN state = 'sleeping' THEN printf('%s slept %s', node, time)
                    WHEN state = 'uninterruptible'
                        THEN printf('%s waited %s for a page or a disk', node, time)
                    ELSE printf('%s ran %s', node, time)
                END
            WHEN 'network_or_idle' THEN printf('%s was on its way for %s', what, time)
            WHEN 'executor_busy'
                THEN printf('kept waiting %s by %s, which ran %s', time, node, what)
            WHEN 'all_threads_busy'
                THEN printf('kept waiting %s for a thread, one ran %s of %s', time, what, node)
            WHEN 'blocked'
                THEN printf('kept waiting %s by %s of %s, which excludes it', time, what, node)
            WHEN 'undecided' THEN printf('%s did not take it for %s', node, time)
            WHEN 'take_to_callback' THEN printf('%s took it %s before it used it', node, time)
            WHEN 'timer' THEN printf('%s waited %s for its timer', node, time)
            WHEN 'unpublished' THEN printf('%s waited %s for %s', node, time, what)
            ELSE printf('%s spent %s on %s', node, time, replace(activity, '_', ' '))
        END,
        ', ' ORDER BY duration_ns DESC, place
    ) AS culprit
FROM named
