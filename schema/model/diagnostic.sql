-- name: staging.diagnostic
-- description: What was found in the input while the model was built.
-- grain: one row per finding
-- needs: staging.event_count, staging.damage, staging.gap, staging.process,
--     staging.callback_instance, staging.callback_left_over,
--     staging.node, staging.publisher, staging.subscription, staging.callback, staging.host,
--     staging.left_out, staging.source, staging.publisher_known, staging.subscription_known,
--     staging.client, staging.service, staging.client_event, staging.service_event,
--     staging.client_gid, staging.request_pair,
--     staging.annotation, staging.annotation_object, staging.timer, staging.callback_owner,
--     staging.buffer_owner, staging.trace, staging.clock, staging.network_packet,
--     staging.single_packet, staging.link_packet
WITH unmatched_end AS (
    SELECT trace_index
    FROM staging.callback_left_over
    WHERE NOT is_start AND partner_event_id IS NULL
),
process_label AS (
    SELECT p.process_id, p.life, printf('%s %d on %s', coalesce(p.name, '?'), p.pid, h.hostname)
        AS label
    FROM staging.process AS p
    JOIN staging.host AS h ON p.host_id = h.host_id
),
damage AS (
    SELECT
        trace_index, file, position, byte_offset, message,
        row_number() OVER (PARTITION BY trace_index ORDER BY file, position, byte_offset, message)
            AS number
    FROM staging.damage
),
initialised AS (
    SELECT
        process_id, publisher_handle AS handle, topic_name,
        lag(topic_name) OVER (
            PARTITION BY process_id, publisher_handle ORDER BY event_id
        ) AS previous_topic
    FROM staging.publisher_known
    UNION ALL
    SELECT
        process_id, subscription_handle, topic_name,
        lag(topic_name) OVER (PARTITION BY process_id, subscription_handle ORDER BY event_id)
    FROM staging.subscription_known
),
inferred AS (
    SELECT 'node' AS kind, process_id FROM staging.node WHERE is_inferred
    UNION ALL
    SELECT 'publisher', process_id FROM staging.publisher WHERE is_inferred AND NOT is_internal
    UNION ALL
    SELECT 'subscription', process_id FROM staging.subscription WHERE is_inferred
    UNION ALL
    SELECT 'timer', process_id FROM staging.timer WHERE created_ns IS NULL
    UNION ALL
    SELECT 'callback', process_id FROM staging.callback WHERE created_ns IS NULL
    UNION ALL
    SELECT 'client', process_id FROM staging.client WHERE created_ns IS NULL
    UNION ALL
    SELECT 'service', process_id FROM staging.service WHERE created_ns IS NULL
),
-- Of what callbacks that ran belong to.
owner AS (
    SELECT 'eliminated_owner' AS name, process_id FROM staging.callback_owner WHERE is_eliminated
    UNION ALL
    SELECT 'unknown_owner', c.process_id
    FROM staging.callback AS c
    WHERE c.kind = 'unknown'
        AND c.callback_id IN (
            SELECT callback_id
            FROM staging.callback_instance
            WHERE callback_id IN (SELECT callback_id FROM staging.callback WHERE kind = 'unknown')
        )
    UNION ALL
    SELECT 'ambiguous_buffer', process_id
    FROM staging.buffer_owner
    WHERE subscription_event_id IS NULL
),
ambiguous_request AS (
    SELECT DISTINCT t.event_id
    FROM staging.service_event AS t
    JOIN staging.client_gid AS g ON t.gid = g.gid
    JOIN staging.client_event AS s
        ON g.client_event_id = s.client_event_id AND t.sequence_number = s.sequence_number
    ANTI JOIN staging.request_pair AS p ON t.event_id = p.take_event_id
    WHERE t.is_request AND s.is_request
),
packet_use AS (
    SELECT
        count(*) AS number,
        count(CASE WHEN p.is_sent THEN 1 END) AS sent,
        count(CASE WHEN p.key IS NULL THEN 1 END) AS unknown,
        count(CASE WHEN p.key IS NOT NULL AND s.event_id IS NULL THEN 1 END) AS repeated,
        count(s.event_id) AS single,
        string_agg(DISTINCT h.hostname, ' and ' ORDER BY h.hostname) AS hosts
    FROM staging.network_packet AS p
    JOIN staging.trace AS t ON p.trace_id = t.trace_id
    JOIN staging.host AS h ON t.host_id = h.host_id
    LEFT JOIN staging.single_packet AS s ON p.event_id = s.event_id
    HAVING count(*) > 0 AND (SELECT count(*) FROM staging.clock) > 1
)
SELECT
    e.trace_index + 1 AS trace_id,
    'unknown_event' AS name,
    'info' AS severity,
    sum(e.event_count)::BIGINT AS count,
    'events that are not in the catalogue and were not loaded: '
    || CASE
        WHEN s.domain = 'kernel' THEN printf('kernel events of %d names', count(*))
        ELSE string_agg(printf('%s (%d)', e.name, e.event_count), ', ' ORDER BY e.name)
    END AS detail
FROM staging.event_count AS e
JOIN staging.source AS s ON e.trace_index = s.trace_index
WHERE NOT e.is_known
GROUP BY e.trace_index, s.domain
UNION ALL
SELECT
    t.trace_id,
    'empty_trace',
    'warning',
    1,
    'no event was recorded: ' || t.path
FROM staging.trace AS t
-- A chunk of a recording may well be empty, and of a copy nothing is read.
WHERE t.event_count = 0
    AND coalesce(t.uuid NOT IN (SELECT uuid FROM staging.trace WHERE event_count > 0), true)
UNION ALL
SELECT
    trace_id,
    CASE kind WHEN 'loss' THEN 'discarded_events' WHEN 'packets' THEN 'lost_packets'
        ELSE 'pause' END,
    CASE kind WHEN 'pause' THEN 'warning' ELSE 'data_loss' END,
    CASE kind
        WHEN 'loss' THEN least(coalesce(sum(event_count), count(*)), 9007199254740992)
        ELSE count(*)
    END::BIGINT,
    CASE kind
        WHEN 'loss' THEN printf(
            'events that the tracer discarded in %d place%s, %.3f s in all: use more or larger '
            || 'sub-buffers',
            count(*), CASE WHEN count(*) = 1 THEN '' ELSE 's' END, sum(end_ns - start_ns) / 1e9
        )
        WHEN 'packets' THEN 'places where whole packets were overwritten or are missing'
        ELSE printf(
            'times at which tracing was paused, %.3f s in all', sum(end_ns - start_ns) / 1e9
        )
    END
FROM staging.gap
-- Events that are missing from a packet that was cut off are reported as damaged_trace.
WHERE kind <> 'loss'
    OR event_count IS NOT NULL
    OR trace_id NOT IN (SELECT trace_index + 1 FROM staging.damage)
GROUP BY trace_id, kind
UNION ALL
SELECT
    trace_index + 1,
    'damaged_trace',
    'data_loss',
    1,
    printf('%s — %s, packet %d, byte %d', message, file, position, byte_offset)
FROM damage
WHERE number <= 20
UNION ALL
SELECT
    trace_index + 1,
    'damaged_trace',
    'data_loss',
    count(*),
    'further damage of the same trace'
FROM damage
WHERE number > 20
GROUP BY trace_index
UNION ALL
SELECT
    NULL,
    'process_restart',
    'info',
    count(*),
    'process ids that were used again by a new process: '
    || string_agg(label, ', ' ORDER BY process_id)
FROM process_label
WHERE life > 1
HAVING count(*) > 0
UNION ALL
SELECT
    trace_id,
    'open_callback',
    'info',
    count(*),
    'callback instances without an end: the trace or the process ended, a callback threw, or '
    || 'events were lost'
FROM staging.callback_instance
WHERE end_ns IS NULL
GROUP BY trace_id
UNION ALL
SELECT
    trace_index + 1,
    'unmatched_callback_end',
    'warning',
    count(*),
    'ends of callbacks without a start: tracing started inside a callback, or events were lost'
FROM unmatched_end
GROUP BY trace_index
UNION ALL
SELECT
    NULL,
    'inferred_' || i.kind,
    'warning',
    count(*),
    'objects that were used but whose initialisation was not traced (tracing started late, or '
    || 'events were lost), in ' || string_agg(DISTINCT l.label, ', ' ORDER BY l.label)
FROM inferred AS i
JOIN process_label AS l ON i.process_id = l.process_id
GROUP BY i.kind
UNION ALL
SELECT
    NULL,
    o.name,
    'warning',
    count(*),
    CASE o.name
        WHEN 'eliminated_owner' THEN
            'callbacks attributed to timers or services by elimination: their initialisation was '
            || 'not traced, and executors ran them without a take; subscriptions of loaned '
            || 'messages would look like timers, in '
        WHEN 'unknown_owner' THEN
            'callbacks whose timer, service or subscription is not known (no executor events, '
            || 'takes that were not recorded, or loaned messages), in '
        ELSE
            'ring buffers without a known subscription: their creation was not traced, and several '
            || 'callbacks got messages from one, or one callback from several, in '
    END || string_agg(DISTINCT l.label, ', ' ORDER BY l.label)
FROM owner AS o
JOIN process_label AS l ON o.process_id = l.process_id
GROUP BY o.name
UNION ALL
SELECT
    o.trace_index + 1,
    'overlapping_traces',
    'warning',
    o.event_count,
    printf(
        'events of %d threads, over %.3f s, left out because the trace %s has them too',
        o.thread_count, o.length_ns / 1e9, s.path
    )
FROM staging.left_out AS o
JOIN staging.source AS s ON o.used_index = s.trace_index
UNION ALL
SELECT
    NULL,
    'clock_offsets_differ',
    'info',
    count(*),
    printf(
        'traces of one boot whose clock offset differs from the first one by %+.3f ms to %+.3f ms: '
        || 'brought to one time base',
        -max(clock_correction_ns) / 1e6, -min(clock_correction_ns) / 1e6
    )
FROM staging.source
WHERE clock_correction_ns <> 0
HAVING count(*) > 0
UNION ALL
SELECT
    NULL,
    'repeated_initialisation',
    'info',
    count(*),
    'publishers and subscriptions initialised on the handle of another one of the same topic: '
    || 'created again, or traced twice; the later one counts from then on: '
    || string_agg(DISTINCT topic_name, ', ' ORDER BY topic_name)
FROM initialised
WHERE topic_name = previous_topic
HAVING count(*) > 0
UNION ALL
SELECT
    NULL,
    'ambiguous_request',
    'warning',
    count(*),
    'requests taken by a service for which several requests of the same client and number are '
    || 'possible: they are left without a sender'
FROM ambiguous_request
HAVING count(*) > 0
UNION ALL
SELECT
    NULL,
    'unknown_annotation_handle',
    'warning',
    count(*),
    'inputs or outputs of declared indirect links that are not known subscriptions or '
    || 'publishers, in ' || string_agg(DISTINCT l.label, ', ' ORDER BY l.label)
FROM staging.annotation AS a
JOIN staging.annotation_object AS o ON a.event_id = o.event_id
JOIN process_label AS l ON a.process_id = l.process_id
WHERE o.object_id IS NULL
HAVING count(*) > 0
UNION ALL
SELECT
    s.trace_index + 1,
    'no_network_packets',
    'info',
    1,
    'the kernel trace has no network packets, which would help to synchronise the clocks: enable '
    || 'net_dev_queue and net_if_receive_skb on every host'
FROM staging.source AS s
ANTI JOIN staging.network_packet AS p ON s.trace_index + 1 = p.trace_id
WHERE s.domain = 'kernel' AND (SELECT count(*) FROM staging.clock) > 1
UNION ALL
SELECT
    NULL,
    'network_packets_unused',
    'info',
    u.number - l.ends,
    printf(
        'of %d network packets sent and %d received on %s, %d were seen on both ends; not used: '
        || '%d that look like others, %d that were repeated within 2 s or sent by several hosts, '
        || '%d whose other end was not seen or is not certain',
        u.sent, u.number - u.sent, u.hosts, l.links, u.unknown, u.repeated, u.single - l.ends
    )
FROM packet_use AS u
CROSS JOIN (
    SELECT
        count(*) AS links,
        count(DISTINCT sent_event_id) + count(DISTINCT received_event_id) AS ends
    FROM staging.link_packet
) AS l
WHERE u.number > l.ends
