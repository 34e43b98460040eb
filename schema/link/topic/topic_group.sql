-- description: Which publishers and subscriptions whose topic is not known are on one topic, as
--     far as messages tell. A stamp that only one publication of the run has belongs to one
--     message: its publisher and those who took it are on one topic. So are those of a message
--     that went through a ring buffer, and whatever else such messages join to any of them. The
--     group has the name of those members that have one; if they have several names, nothing is
--     learned. A pair that hardly any message of both sides speaks for is chance.
-- grain: one row per publisher or subscription without a topic of its own that messages join
CREATE OR REPLACE MACRO derive.topic_group(only_run) AS TABLE
WITH RECURSIVE endpoint AS (
    SELECT
        run_id,
        publisher_id AS vertex,
        CASE WHEN NOT coalesce(is_topic_learned, false) THEN topic_name END AS topic_name,
        is_internal
    FROM store.publisher
    WHERE run_id = only_run
    UNION ALL
    SELECT
        run_id,
        -subscription_id,
        CASE WHEN NOT coalesce(is_topic_learned, false) THEN topic_name END,
        is_internal
    FROM store.subscription
    WHERE run_id = only_run
),
concerned AS (SELECT DISTINCT run_id FROM endpoint WHERE topic_name IS NULL),
published AS (
    SELECT
        b.run_id, b.source_timestamp_ns,
        any_value(b.publisher_id) AS publisher_id
    FROM store.publication AS b
    SEMI JOIN concerned AS c ON b.run_id = c.run_id
    WHERE b.run_id = only_run AND b.source_timestamp_ns <> 0
    GROUP BY b.run_id, b.source_timestamp_ns
    HAVING count(*) = 1
),
-- Ring buffers that were used by objects without a topic, with all that went through these buffers.
unknown_buffer AS (
    SELECT r.run_id, r.process_id, r.buffer_handle
    FROM store.ring_buffer_event AS r
    JOIN store.take AS t ON r.take_id = t.take_id
    WHERE r.run_id = only_run AND t.subscription_id IN (
        SELECT subscription_id
        FROM store.subscription
        WHERE is_inferred
            AND rmw_handle IS NULL
            AND (topic_name IS NULL OR coalesce(is_topic_learned, false))
    )
    UNION
    SELECT r.run_id, r.process_id, r.buffer_handle
    FROM store.ring_buffer_event AS r
    JOIN store.publication AS b ON r.publication_id = b.publication_id
    WHERE r.run_id = only_run
        AND b.intra_ns IS NOT NULL
        AND b.publisher_id IN (
            SELECT publisher_id
            FROM store.publisher
            WHERE is_inferred AND (topic_name IS NULL OR coalesce(is_topic_learned, false))
        )
),
slot_use AS (
    SELECT
        r.kind, r.take_id,
        lag(r.kind) OVER in_slot AS previous_kind,
        lag(r.publication_id) OVER in_slot AS publication_id
    FROM store.ring_buffer_event AS r
    SEMI JOIN unknown_buffer AS u
        ON r.run_id = u.run_id AND r.process_id = u.process_id AND r.buffer_handle = u.buffer_handle
    WHERE r.run_id = only_run
    WINDOW in_slot AS (
        PARTITION BY r.run_id, r.process_id, r.buffer_handle, r.slot ORDER BY r.event_id
    )
),
pair AS (
    SELECT
        p.publisher_id, t.subscription_id,
        count(*) AS message_count
    FROM published AS p
    JOIN store.take AS t ON p.run_id = t.run_id AND p.source_timestamp_ns = t.source_timestamp_ns
    WHERE t.run_id = only_run AND p.publisher_id IS NOT NULL AND t.subscription_id IS NOT NULL
    GROUP BY p.publisher_id, t.subscription_id
    UNION ALL
    SELECT
        b.publisher_id, t.subscription_id,
        count(*)
    FROM slot_use AS s
    JOIN store.publication AS b ON s.publication_id = b.publication_id
    JOIN store.take AS t ON s.take_id = t.take_id
    WHERE s.kind = 'dequeue'
        AND s.previous_kind = 'enqueue'
        AND b.publisher_id IS NOT NULL
        AND t.subscription_id IS NOT NULL
    GROUP BY b.publisher_id, t.subscription_id
),
likely AS (
    SELECT
        publisher_id,
        -subscription_id AS subscription_vertex
    FROM pair
    QUALIFY 10 * message_count >= max(message_count) OVER (PARTITION BY publisher_id)
        OR 10 * message_count >= max(message_count) OVER (PARTITION BY subscription_id)
),
edge AS MATERIALIZED (
    SELECT
        publisher_id AS from_vertex,
        subscription_vertex AS to_vertex
    FROM likely
    UNION ALL
    SELECT subscription_vertex, publisher_id
    FROM likely
),
reached (start, vertex) AS (
    SELECT vertex, vertex
    FROM endpoint
    WHERE topic_name IS NULL AND vertex IN (SELECT from_vertex FROM edge)
    UNION
    SELECT r.start, e.to_vertex
    FROM reached AS r
    JOIN endpoint AS p ON r.vertex = p.vertex AND p.topic_name IS NULL
    JOIN edge AS e ON r.vertex = e.from_vertex
)
SELECT
    s.run_id,
    CASE WHEN r.start > 0 THEN 'publisher' ELSE 'subscription' END AS kind,
    abs(r.start) AS id,
    min(CASE WHEN p.topic_name IS NULL THEN r.vertex END) AS group_id,
    any_value(p.topic_name) AS topic_name,
    coalesce(bool_and(CASE WHEN p.topic_name IS NOT NULL THEN p.is_internal END), false)
        AS is_internal
FROM reached AS r
JOIN endpoint AS s ON r.start = s.vertex
JOIN endpoint AS p ON r.vertex = p.vertex
GROUP BY s.run_id, r.start
HAVING count(DISTINCT p.topic_name) <= 1
