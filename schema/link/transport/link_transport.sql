-- description: Messages from publication to take, by every method. A self loop is a transform that
--     is taken by the node that sent it, or by the transform listener of its process: no flow
--     passes through it. Lost events cannot spoil a link by equal stamps and topics, or by the
--     number of Agnocast, with one candidate. They can spoil any other: where a gap of the sender's
--     trace lies between the publication and the take (on hosts with different clocks: within the
--     publication), or a gap of the receiver's trace likewise, the better candidate may be in the
--     gap. A reader of ring buffers may get a message through the middleware as well, without a
--     callback: that take is a copy that no callback gets. So are the takes of a placeholder that
--     nothing joins with the reader of the buffer. Where a process is several with equal ids,
--     nothing says whose messages it sent or got.
-- grain: one row per take whose publication is known
-- reads: derive.link_transport_exact, derive.link_transport_nearest,
--     derive.link_transport_ring_buffer, derive.link_transport_agnocast
-- param: links VARCHAR  Name of the rows of all methods
-- param: has_gaps BOOLEAN = true  The recording has gaps; false: none is looked up
CREATE OR REPLACE MACRO derive.link_transport(links, only_run, has_gaps := true) AS TABLE
WITH link AS (
    SELECT
        run_id, publication_id, take_id, publisher_id, subscription_id, method, candidate_count,
        is_loss_affected
    FROM query_table(links)
),
-- Most runs have none: then no publication or take need be looked up.
doubtful AS MATERIALIZED (
    SELECT publication_id, take_id
    FROM link
    WHERE method NOT IN ('exact', 'agnocast') OR candidate_count > 1
),
-- When a gap may hide a better candidate, in the trace of the sender and in that of the receiver.
guess AS (
    SELECT
        l.take_id,
        unnest([
            {
                'trace_id': b.trace_id,
                'from_ns': b.start_ns,
                'until_ns': CASE
                    WHEN bh.clock_id = th.clock_id THEN greatest(b.end_ns, t.taken_ns)
                    ELSE b.end_ns
                END
            },
            {
                'trace_id': t.trace_id,
                'from_ns': CASE
                    WHEN bh.clock_id = th.clock_id THEN least(b.start_ns, t.taken_ns)
                    ELSE t.taken_ns
                END,
                'until_ns': t.taken_ns
            }
        ]) AS side
    FROM doubtful AS l
    JOIN (
        SELECT * FROM store.publication WHERE run_id = only_run AND EXISTS (SELECT 1 FROM doubtful)
    ) AS b ON l.publication_id = b.publication_id
    JOIN store.process AS bp ON b.process_id = bp.process_id
    JOIN store.host AS bh ON bp.host_id = bh.host_id
    JOIN (
        SELECT * FROM store.take WHERE run_id = only_run AND EXISTS (SELECT 1 FROM doubtful)
    ) AS t ON l.take_id = t.take_id
    JOIN store.process AS tp ON t.process_id = tp.process_id
    JOIN store.host AS th ON tp.host_id = th.host_id
    WHERE has_gaps
),
exposed AS (
    SELECT DISTINCT q.take_id
    FROM guess AS q
    JOIN derive.exposed_trace AS x ON q.side.trace_id = x.trace_id
    ASOF JOIN (
        SELECT recording_id, start_ns, covered_until_ns
        FROM derive.recording_gap
        WHERE run_id = only_run
    ) AS g ON x.recording_id = g.recording_id AND q.side.until_ns >= g.start_ns
    WHERE g.covered_until_ns >= q.side.from_ns
),
intra_process AS (
    SELECT publisher_id, process_id
    FROM store.publication
    WHERE run_id = only_run AND intra_ns IS NOT NULL
),
-- rclcpp makes a second callback for what comes out of a buffer. It may never get its turn.
buffered AS (
    SELECT subscription_id
    FROM store.take
    WHERE run_id = only_run AND method = 'ring_buffer' AND subscription_id IS NOT NULL
    UNION
    SELECT subscription_id
    FROM store.callback
    WHERE run_id = only_run AND subscription_id IS NOT NULL
    GROUP BY subscription_id
    HAVING count(*) > 1
),
repeated AS (
    SELECT l.take_id
    FROM link AS l
    SEMI JOIN intra_process AS i ON l.publisher_id = i.publisher_id
    JOIN store.publisher AS p ON l.publisher_id = p.publisher_id
    JOIN store.subscription AS s
        ON l.subscription_id = s.subscription_id AND p.process_id = s.process_id
    LEFT JOIN buffered AS b ON l.subscription_id = b.subscription_id
    WHERE l.method <> 'ring_buffer' AND (b.subscription_id IS NOT NULL OR s.is_inferred)
),
-- Before Iron, no event shows that a publisher passes messages on within its process. It does so
-- where callbacks get messages in this way, and none gets what comes from that publisher through
-- the middleware.
silent AS (
    SELECT l.publisher_id, l.subscription_id
    FROM link AS l
    JOIN store.publisher AS p ON l.publisher_id = p.publisher_id
    JOIN store.subscription AS s
        ON l.subscription_id = s.subscription_id AND p.process_id = s.process_id
    ANTI JOIN intra_process AS e ON p.process_id = e.process_id
    SEMI JOIN (
        SELECT c.subscription_id
        FROM store.callback_instance AS i
        JOIN store.callback AS c ON i.callback_id = c.callback_id
        WHERE i.run_id = only_run AND i.is_intra_process
    ) AS b ON l.subscription_id = b.subscription_id
    LEFT JOIN store.callback_instance AS c ON l.take_id = c.take_id
    GROUP BY l.publisher_id, l.subscription_id
    HAVING count(c.callback_instance_id) = 0
),
copy AS (
    SELECT r.take_id
    FROM repeated AS r
    ANTI JOIN store.callback_instance AS c ON r.take_id = c.take_id
    UNION
    SELECT l.take_id
    FROM link AS l
    JOIN silent AS n ON l.publisher_id = n.publisher_id AND l.subscription_id = n.subscription_id
    WHERE l.method <> 'ring_buffer'
),
-- Of processes that are several with equal ids.
mixed_take AS (
    SELECT take_id
    FROM store.take
    WHERE run_id = only_run
        AND process_id IN (SELECT process_id FROM store.process WHERE is_ambiguous)
)
SELECT
    l.run_id, l.publication_id, l.take_id, l.publisher_id, l.subscription_id, l.method,
    greatest(
        l.candidate_count, CASE WHEN coalesce(mb.publication_id, mt.take_id) IS NOT NULL THEN 2 END
    ) AS candidate_count,
    coalesce(
        p.topic_name IN ('/tf', '/tf_static')
        AND (
            p.node_id = s.node_id
            OR (p.process_id = s.process_id AND starts_with(n.name, 'transform_listener_impl'))
        ),
        false
    ) AS is_self_loop,
    l.is_loss_affected OR x.take_id IS NOT NULL AS is_loss_affected,
    c.take_id IS NOT NULL AS is_copy
FROM link AS l
LEFT JOIN store.publisher AS p ON l.publisher_id = p.publisher_id
LEFT JOIN store.subscription AS s ON l.subscription_id = s.subscription_id
LEFT JOIN store.node AS n ON s.node_id = n.node_id
LEFT JOIN exposed AS x ON l.take_id = x.take_id
LEFT JOIN copy AS c ON l.take_id = c.take_id
LEFT JOIN derive.mixed_publication(only_run) AS mb ON l.publication_id = mb.publication_id
LEFT JOIN mixed_take AS mt ON l.take_id = mt.take_id
