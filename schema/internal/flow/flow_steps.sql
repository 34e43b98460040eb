-- description: The steps of `main.flow_step`, with how long the executor was busy before the
--     callbacks of takes and requests, and when the thread went on after a publication
--     (until_ns): writing the message comes after the last event of the call, so that it took until
--     then at most. And the events of the user's own tracepoints inside of callback instances. And
--     what else made the node of a dead end publish (main.dead_end): there a link may be missing.
--     And how long a message was stored, until its subscription existed (stored_ns). And the
--     services that a callback instance called and waited for (calls).
-- grain: one row per vertex and link that leads to it
-- param: kind, id
-- param: direction VARCHAR {forward|backward|both} = 'both'  Follow what it caused, what caused it,
--     or both
-- param: depth INTEGER {0..} = 32  Maximum number of messages in a row, each way
-- param: limit INTEGER {1..} = 1000  Maximum number of publications, takes, callback instances,
--     requests and responses
-- param: internal BOOLEAN = false  Follow effects on topics and services of ROS itself too
-- param: run_id BIGINT  Its run
WITH step AS MATERIALIZED (
    FROM main.flow_step(
        $kind, $id,
        direction := $direction,
        -- A message is three steps; no flow within the limit has more than it has vertices.
        max_depth := least($depth::BIGINT * 3, 10000)::INTEGER,
        max_vertices := $limit,
        internal := $internal
    )
),
sent AS (
    SELECT publication_id, process_id, thread_id, end_event_id
    FROM store.publication
    WHERE publication_id IN (SELECT id FROM step WHERE kind = 'publication')
),
next AS (
    SELECT
        run_id, thread_id,
        start_event_id AS event_id,
        start_ns AS at_ns
    FROM store.publication
    UNION ALL
    SELECT run_id, thread_id, start_event_id, taken_ns
    FROM store.take
    WHERE start_event_id IS NOT NULL
    UNION ALL
    SELECT run_id, thread_id, start_event_id, start_ns
    FROM store.callback_instance
    UNION ALL
    SELECT run_id, thread_id, end_event_id, end_ns
    FROM store.callback_instance
    WHERE end_event_id IS NOT NULL
    UNION ALL
    SELECT run_id, thread_id, start_event_id, start_ns
    FROM store.executor_state
),
went_on AS (
    SELECT
        s.publication_id,
        derive.corrected_ns(n.at_ns, c) AS until_ns
    FROM sent AS s
    ASOF JOIN (
        SELECT thread_id, event_id, at_ns
        FROM next
        WHERE run_id = $run_id AND thread_id IN (SELECT thread_id FROM sent)
    ) AS n
        ON s.thread_id = n.thread_id AND s.end_event_id < n.event_id
    ASOF LEFT JOIN store.thread_break AS b
        ON s.thread_id = b.thread_id AND s.end_event_id < b.resumed_event_id
    JOIN derive.process_clock AS c ON s.process_id = c.process_id
    -- In a gap between the two the thread may have gone on.
    WHERE coalesce(b.resumed_event_id > n.event_id, true)
),
named AS (
    SELECT
        callback_instance_id, name,
        count(*) AS event_count,
        min(at_ns) AS first_ns,
        min(user_event_id) AS first_id
    FROM main.user_event
    WHERE callback_instance_id IN (SELECT id FROM step WHERE kind = 'callback_instance')
    GROUP BY callback_instance_id, name
),
happened AS (
    SELECT
        callback_instance_id,
        list(
            {'name': name, 'event_count': event_count, 'first_ns': first_ns}
            ORDER BY first_ns, first_id
        ) AS user_events
    FROM named
    GROUP BY callback_instance_id
),
ended AS (
    SELECT
        d.subscription_id,
        derive.names_in_words(d.published) AS published
    FROM (
        SELECT
            subscription_id,
            derive.names_in_words(output_topic) || ' ' || cause AS published
        FROM main.dead_end([$run_id])
        WHERE NOT is_loop AND leading_count = 0
        GROUP BY subscription_id, cause
    ) AS d
    GROUP BY d.subscription_id
),
otherwise AS (
    SELECT i.callback_instance_id, e.published
    FROM store.callback_instance AS i
    JOIN store.callback AS c ON i.callback_id = c.callback_id
    JOIN ended AS e ON c.subscription_id = e.subscription_id
    WHERE i.run_id = $run_id
        AND i.callback_instance_id IN (SELECT id FROM step WHERE kind = 'callback_instance')
),
called AS (
    SELECT
        callback_instance_id,
        list(
            {
                'service': service_name, 'server': server, 'waited_ns': returned_ns - sent_ns,
                'queue_ns': queue_ns, 'served_ns': served_ns
            }
            ORDER BY sent_ns, request_id
        ) AS calls
    FROM main.waited_call
    WHERE run_id = $run_id
        AND callback_instance_id IN (SELECT id FROM step WHERE kind = 'callback_instance')
    GROUP BY callback_instance_id
)
SELECT
    s.run_id, s.kind, s.id, s.depth, s.start_ns, s.end_ns, s.node, s.label, s.topic_name, s.symbol,
    s.thread, s.host, w.busy_min_ns, w.busy_max_ns, u.until_ns, v.user_events,
    o.published AS otherwise_published,
    y.calls, s.missing, s.reason, s.cut_count, s.internal_count, s.from_kind, s.from_id,
    s.link_kind, s.wait_ns, k.stored_ns, s.candidate_count, s.is_loss_affected
FROM step AS s
LEFT JOIN (
    SELECT callback_instance_id, busy_min_ns, busy_max_ns
    FROM main.executor_wait
    WHERE run_id = $run_id AND since IN ('publication', 'request')
) AS w ON s.kind = 'callback_instance' AND s.id = w.callback_instance_id
LEFT JOIN happened AS v ON s.kind = 'callback_instance' AND s.id = v.callback_instance_id
LEFT JOIN otherwise AS o ON s.kind = 'callback_instance' AND s.id = o.callback_instance_id
LEFT JOIN called AS y ON s.kind = 'callback_instance' AND s.id = y.callback_instance_id
LEFT JOIN derive.stored_take AS k
    ON s.kind = 'take' AND s.id = k.take_id AND s.link_kind = 'transport' AND k.run_id = $run_id
LEFT JOIN went_on AS u ON s.kind = 'publication' AND s.id = u.publication_id
ORDER BY abs(s.depth), s.depth, s.start_ns, s.kind, s.id, s.from_kind, s.from_id, s.link_kind
