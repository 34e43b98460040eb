-- title: Callback instances, one by one, the longest first
-- description: Each execution of a callback: when it began, how long it ran and on which thread,
--     which message it was called with, and what it published meanwhile. Instances that never ended
--     come last.
-- grain: one row per callback instance
-- column: run_id
-- column: start_ns BIGINT [epoch ns]  Start of the callback
-- column: duration_ns BIGINT [ns]   From its start to its end; empty: never seen to end
-- column: running_ns BIGINT [ns]    Of that, on a CPU; empty: not known
-- column: preempted_ns BIGINT [ns]  Of that, ready, but the CPU was taken away
-- column: node, callback
-- column: published VARCHAR         Topics of the messages it published itself, and how many of
--     each if several
-- column: publications BIGINT       How many messages it published itself
-- column: process VARCHAR           Process, by its name and id
-- column: tid INTEGER               Thread
-- column: host
-- column: depth INTEGER             1; more: nested in that many callback instances less one
-- column: take_id BIGINT            Message it was called with: msgflow flow --take shows its flow
-- column: is_loss_affected BOOLEAN  A gap of the trace may hide its end or what it did
-- column: callback_instance_id BIGINT  Identity of the callback instance:
--     msgflow flow --callback-instance
-- column: callback_id
-- column: is_internal
-- brief: duration_ns (slowest), node, callback, start_ns, take_id, published, running_ns,
--     preempted_ns, tid, callback_instance_id, process, host
-- note: callbacks
WITH instance AS (
    SELECT
        run_id, callback_instance_id, callback_id, process_id, thread_id, start_ns,
        end_ns - start_ns AS duration_ns,
        cpu_ns, depth, take_id, is_loss_affected
    FROM main.callback_instance
    WHERE list_contains($runs, run_id) AND start_ns >= $start_ns AND start_ns < $end_ns
),
by_topic AS (
    SELECT
        l.callback_instance_id,
        coalesce(p.topic_name, '?') AS topic_name,
        count(*) AS number
    FROM main.link_causal AS l
    JOIN instance AS i ON l.callback_instance_id = i.callback_instance_id
    JOIN main.publication AS b ON l.publication_id = b.publication_id
    JOIN main.publisher AS p ON b.publisher_id = p.publisher_id
    WHERE l.kind = 'direct'
    GROUP BY l.callback_instance_id, coalesce(p.topic_name, '?')
),
published AS (
    SELECT
        callback_instance_id,
        string_agg(
            topic_name || CASE WHEN number > 1 THEN ' ' || number ELSE '' END,
            ', ' ORDER BY topic_name
        ) AS topics,
        sum(number)::BIGINT AS number
    FROM by_topic
    GROUP BY callback_instance_id
)
SELECT
    i.run_id, i.start_ns, i.duration_ns,
    i.cpu_ns AS running_ns,
    s.preempted_ns, l.node,
    l.label AS callback,
    p.topics AS published,
    coalesce(p.number, 0) AS publications,
    printf('%s %d', coalesce(r.name, '?'), r.pid) AS process,
    t.tid,
    h.hostname AS host,
    i.depth, i.take_id, i.is_loss_affected, i.callback_instance_id, i.callback_id, l.is_internal
FROM instance AS i
JOIN main.callback_label AS l ON i.callback_id = l.callback_id
JOIN main.process AS r ON i.process_id = r.process_id
JOIN main.host AS h ON r.host_id = h.host_id
LEFT JOIN main.thread AS t ON i.thread_id = t.thread_id
LEFT JOIN main.callback_schedule AS s ON i.callback_instance_id = s.callback_instance_id
LEFT JOIN published AS p ON i.callback_instance_id = p.callback_instance_id
ORDER BY i.run_id, i.duration_ns DESC NULLS LAST, i.start_ns, i.callback_instance_id
