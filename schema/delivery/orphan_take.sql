-- description: Why the publication of a take is not known: the first reason that holds. The stamp
--     is compared on the host of each process that could have sent it: those with a publisher of
--     the topic (known senders), those with one whose topic is not known or whose initialisation
--     is missing (possible senders), and, if the topic is not known, all with any publisher. A
--     message from a ring buffer has no stamp: it was put in after the message before it, which
--     came from there. If the stamp is that of a message of another topic, and a gap lies after
--     the creation of the subscription, another subscription may have its handle by then. If a
--     publisher whose topic is not known published at that moment, it means nothing that all known
--     senders had ended. A publisher of the topic that was never seen to publish may have sent all
--     that no other one did: some ways to publish have no event. Agnocast's messages have no
--     stamp, but a number, which only a publisher can have given to them.
-- grain: one row per take whose publication is not known
-- when: derive.unlinked_take
-- param: has_gaps BOOLEAN = true  The recording has gaps; false: none is looked up
-- param: has_pauses BOOLEAN = true  Likewise pauses
CREATE OR REPLACE MACRO derive.orphan_take(
    only_run, has_gaps := true, has_pauses := true
) AS TABLE
WITH orphan AS MATERIALIZED (
    SELECT
        t.take_id, t.subscription_id, t.process_id, p.host_id, t.method, t.taken_ns,
        t.is_loss_affected,
        t.source_timestamp_ns AS stamp_ns,
        s.topic_name, s.created_ns
    FROM derive.unlinked_take(only_run) AS u
    JOIN store.take AS t ON u.take_id = t.take_id
    JOIN store.process AS p ON t.process_id = p.process_id
    LEFT JOIN store.subscription AS s ON t.subscription_id = s.subscription_id
),
presence AS MATERIALIZED (
    SELECT
        process_id,
        min(begin_ns) AS begin_ns,
        min(recorded_from_ns) AS recorded_from_ns
    FROM derive.process_presence
    WHERE run_id = only_run
    GROUP BY process_id
),
gap AS MATERIALIZED (
    SELECT process_id, start_ns, covered_until_ns
    FROM derive.process_gap(only_run, has_gaps, has_pauses)
),
stampless AS (
    SELECT process_id
    FROM store.publication
    WHERE run_id = only_run AND publisher_id IS NOT NULL
    GROUP BY process_id
    HAVING count(source_timestamp_ns) = 0
),
-- Likewise of single topics.
channelled AS (
    SELECT DISTINCT p.topic_name, b.process_id
    FROM derive.unstamped_call(only_run) AS b
    JOIN store.publisher AS p ON b.publisher_id = p.publisher_id
    WHERE b.is_without_event
),
-- Before Humble takes have no event of their own, and before Iron what leaves a ring buffer has
-- none: that they have no stamp is not due to loss.
showing AS (
    SELECT
        p.host_id,
        bool_or(t.source_timestamp_ns IS NOT NULL) AS has_stamps,
        bool_or(t.method = 'ring_buffer') AS has_buffers
    FROM store.take AS t
    JOIN store.process AS p ON t.process_id = p.process_id
    WHERE t.run_id = only_run
    GROUP BY p.host_id
),
stampable AS (
    SELECT o.take_id
    FROM orphan AS o
    JOIN showing AS h ON o.host_id = h.host_id
    LEFT JOIN store.callback_instance AS c ON o.take_id = c.take_id
    WHERE o.stamp_ns IS NULL AND o.method <> 'ring_buffer' AND o.is_loss_affected
        AND CASE WHEN c.is_intra_process THEN h.has_buffers ELSE h.has_stamps END
),
-- Publications whose topic and message are not known.
nameless AS (
    SELECT b.process_id, b.end_ns
    FROM store.publication AS b
    JOIN store.publisher AS p ON b.publisher_id = p.publisher_id
    WHERE b.run_id = only_run AND p.topic_name IS NULL AND b.source_timestamp_ns IS NULL
),
sending AS (
    SELECT
        topic_name, process_id,
        min(coalesce(created_ns, 0)) AS created_ns,
        bool_or(
            publisher_id NOT IN (
                SELECT publisher_id
                FROM store.publication
                WHERE run_id = only_run AND publisher_id IS NOT NULL
            )
        ) AS is_silent
    FROM store.publisher
    WHERE run_id = only_run
    GROUP BY topic_name, process_id
),
-- Processes that may have publishers whose topic the trace does not show.
incomplete AS (
    SELECT process_id FROM sending WHERE topic_name IS NULL
    UNION
    SELECT process_id
    FROM store.publisher
    WHERE run_id = only_run AND is_inferred AND NOT is_internal
    UNION
    SELECT process_id
    FROM store.subscription
    WHERE run_id = only_run AND is_inferred AND NOT is_internal
    UNION
    SELECT process_id FROM store.node WHERE run_id = only_run AND is_inferred
),
candidate AS (
    SELECT
        topic_name, process_id, created_ns,
        true AS is_known,
        is_silent
    FROM sending
    WHERE topic_name IS NOT NULL
    UNION ALL
    SELECT t.topic_name, i.process_id, 0, false, false
    FROM (SELECT DISTINCT topic_name FROM orphan WHERE topic_name IS NOT NULL) AS t
    CROSS JOIN incomplete AS i
    WHERE (t.topic_name, i.process_id) NOT IN (
        SELECT (topic_name, process_id) FROM sending WHERE topic_name IS NOT NULL
    )
    UNION ALL
    SELECT
        NULL, process_id,
        min(created_ns),
        true, false
    FROM sending
    GROUP BY process_id
),
sender AS (
    SELECT
        c.topic_name, c.process_id, c.created_ns, c.is_known, c.is_silent, p.host_id,
        p.last_seen_ns,
        coalesce(r.begin_ns, p.first_seen_ns) AS begin_ns,
        coalesce(r.recorded_from_ns, p.first_seen_ns) AS recorded_from_ns,
        c.process_id IN (SELECT process_id FROM stampless)
        OR (c.topic_name, c.process_id) IN (SELECT (topic_name, process_id) FROM channelled)
            AS is_stampless
    FROM candidate AS c
    JOIN store.process AS p ON c.process_id = p.process_id
    LEFT JOIN presence AS r ON c.process_id = r.process_id
),
-- Each stamp, on the host of each process that could have sent it. If the trace shows that a
-- publisher was created later, it could not.
sent AS (
    SELECT
        o.take_id, s.process_id, s.created_ns, s.last_seen_ns, s.recorded_from_ns, s.is_known,
        s.is_stampless, s.is_silent,
        o.stamp_ns + coalesce(h.shift_ns, 0) AS at_ns,
        o.stamp_ns + coalesce(h.greatest_shift_ns, 0) AS latest_ns
    FROM orphan AS o
    JOIN sender AS s ON o.topic_name IS NOT DISTINCT FROM s.topic_name
    ASOF LEFT JOIN (SELECT * FROM derive.stamp_shift WHERE run_id = only_run) AS h
        ON s.host_id = h.host_id AND o.stamp_ns >= h.from_ns
    WHERE o.stamp_ns IS NOT NULL
        AND (
            s.created_ns < s.begin_ns
            OR s.created_ns
            <= o.stamp_ns + coalesce(h.shift_ns, 0) + derive.delivery_limit().stamp_slack_ns
        )
),
judged AS (
    SELECT
        s.take_id,
        coalesce(
            bool_and(s.at_ns < s.recorded_from_ns) FILTER (WHERE s.is_known),
            bool_and(s.at_ns < s.recorded_from_ns)
        ) AS is_before_tracing,
        bool_or(
            coalesce(g.covered_until_ns >= s.at_ns - derive.delivery_limit().stamp_slack_ns, false)
        ) AS has_gap,
        coalesce(
            bool_and(s.last_seen_ns < s.latest_ns) FILTER (WHERE s.is_known),
            bool_and(s.last_seen_ns < s.latest_ns)
        ) AS has_none_left,
        coalesce(
            bool_or(n.end_ns >= s.at_ns - derive.delivery_limit().stamp_slack_ns), false
        ) AS has_nameless,
        bool_or(s.last_seen_ns < s.latest_ns OR s.at_ns < s.recorded_from_ns) AS has_absent,
        bool_or(s.is_stampless AND s.created_ns <= s.at_ns) AS has_stampless,
        bool_or(s.is_silent) AS has_silent
    FROM sent AS s
    ASOF LEFT JOIN gap AS g
        ON s.process_id = g.process_id
        AND s.latest_ns + derive.delivery_limit().stamp_slack_ns >= g.start_ns
    ASOF LEFT JOIN nameless AS n
        ON s.process_id = n.process_id
        AND s.latest_ns + derive.delivery_limit().stamp_slack_ns >= n.end_ns
    GROUP BY s.take_id
),
-- Messages leave a buffer in the order in which they came. This gives the time in which each was
-- put in.
passed AS (
    SELECT l.subscription_id, t.taken_ns, b.end_ns
    FROM store.link_transport AS l
    JOIN store.take AS t ON l.take_id = t.take_id
    JOIN store.publication AS b ON l.publication_id = b.publication_id
    WHERE l.run_id = only_run
        AND l.method = 'ring_buffer'
        AND l.subscription_id IN (SELECT subscription_id FROM orphan WHERE method = 'ring_buffer')
),
kept AS (
    SELECT
        o.take_id,
        coalesce(b.end_ns, o.created_ns, 0) AS since_ns,
        since_ns < p.recorded_from_ns AS is_before_tracing,
        g.covered_until_ns >= since_ns AS has_gap
    FROM orphan AS o
    LEFT JOIN presence AS p ON o.process_id = p.process_id
    ASOF LEFT JOIN passed AS b ON o.subscription_id = b.subscription_id AND o.taken_ns > b.taken_ns
    ASOF LEFT JOIN gap AS g ON o.process_id = g.process_id AND o.taken_ns >= g.start_ns
    WHERE o.method = 'ring_buffer'
),
-- Publications that the stamp fits, though none of them could be chosen.
fitting AS (
    SELECT
        o.take_id, o.process_id, o.created_ns, o.taken_ns,
        coalesce(o.topic_name <> p.topic_name, false) AS is_of_another_topic
    FROM orphan AS o
    JOIN store.publication AS b ON o.stamp_ns = b.source_timestamp_ns
    LEFT JOIN store.publisher AS p ON b.publisher_id = p.publisher_id
    WHERE b.run_id = only_run AND o.stamp_ns <> 0
),
replaced AS (
    SELECT o.take_id
    FROM fitting AS o
    ASOF JOIN gap AS g ON o.process_id = g.process_id AND o.taken_ns >= g.start_ns
    WHERE o.is_of_another_topic AND g.covered_until_ns >= o.created_ns
)
SELECT
    only_run::BIGINT AS run_id,
    o.take_id, o.subscription_id,
    CASE
        WHEN k.has_gap THEN 'publisher_gap'
        WHEN k.is_before_tracing THEN 'before_tracing'
        WHEN o.take_id IN (SELECT take_id FROM stampable) THEN 'receiver_gap'
        WHEN o.method = 'agnocast' THEN CASE
            WHEN o.topic_name IN (SELECT topic_name FROM sending)
                OR EXISTS (SELECT 1 FROM incomplete) THEN 'unknown'
            ELSE 'publisher_not_traced'
        END
        WHEN o.stamp_ns IS NULL THEN 'no_stamp'
        WHEN n.is_clock_set THEN 'clock_set'
        WHEN coalesce(
            j.is_before_tracing,
            o.stamp_ns < (
                SELECT min(start_ns)
                FROM store.trace
                WHERE run_id = only_run AND domain IS DISTINCT FROM 'kernel'
            )
        ) THEN 'before_tracing'
        WHEN j.has_gap THEN 'publisher_gap'
        WHEN j.has_none_left AND j.has_silent THEN 'publisher_without_events'
        WHEN j.has_none_left AND NOT j.has_nameless THEN 'publisher_trace_ends'
        WHEN o.take_id IN (SELECT take_id FROM fitting WHERE NOT is_of_another_topic)
            OR n.is_clock_set IS NOT NULL THEN 'ambiguous'
        WHEN o.take_id IN (SELECT take_id FROM replaced) THEN 'receiver_gap'
        WHEN j.has_silent THEN 'publisher_without_events'
        WHEN j.take_id IS NULL OR NOT (j.has_absent OR j.has_stampless)
            THEN 'publisher_not_traced'
        ELSE 'unknown'
    END AS reason
FROM orphan AS o
LEFT JOIN judged AS j ON o.take_id = j.take_id
LEFT JOIN kept AS k ON o.take_id = k.take_id
LEFT JOIN (
    SELECT
        topic_name, source_timestamp_ns,
        candidate_count IS NULL AS is_clock_set
    FROM store.nearest_message
    WHERE run_id = only_run AND publication_id IS NULL
) AS n ON o.topic_name = n.topic_name AND o.stamp_ns = n.source_timestamp_ns
