-- name: derive.orphan_take
-- kind: macro
-- description: Why the publication of a take is not known; the first reason that holds. The stamp
--     is compared on the host of each process that could have sent it: those with a publisher of
--     the topic, or with any where the topic is not known.
-- grain: one row per take whose publication is not known
-- needs: store.take, store.link_transport, store.subscription, store.publisher,
--     store.publication, store.process, store.trace, derive.stamp_shift, derive.process_gap,
--     derive.take_candidate, store.nearest_message
CREATE OR REPLACE MACRO derive.orphan_take(of_run) AS TABLE
WITH orphan AS MATERIALIZED (
    SELECT t.take_id, t.subscription_id, t.source_timestamp_ns AS stamp_ns, s.topic_name
    FROM (SELECT * FROM store.take WHERE run_id = of_run) AS t
    ANTI JOIN store.link_transport AS l ON t.take_id = l.take_id
    LEFT JOIN store.subscription AS s ON t.subscription_id = s.subscription_id
),
host_begin AS (
    SELECT host_id, min(start_ns) AS begin_ns
    FROM store.trace
    WHERE run_id = of_run AND domain IS DISTINCT FROM 'kernel'
    GROUP BY host_id
),
stampless AS (
    SELECT process_id
    FROM store.publication
    WHERE run_id = of_run AND publisher_id IS NOT NULL
    GROUP BY process_id
    HAVING count(source_timestamp_ns) = 0
),
sending AS (
    SELECT topic_name, process_id, min(coalesce(created_ns, 0)) AS created_ns
    FROM store.publisher
    WHERE run_id = of_run
    GROUP BY topic_name, process_id
),
sender AS (
    SELECT
        s.topic_name, s.process_id, s.created_ns, p.host_id, p.last_seen_ns, h.begin_ns,
        s.process_id IN (SELECT process_id FROM stampless) AS is_stampless
    FROM (
        SELECT topic_name, process_id, created_ns
        FROM sending
        WHERE topic_name IS NOT NULL
        UNION ALL
        SELECT NULL, process_id, min(created_ns)
        FROM sending
        GROUP BY process_id
    ) AS s
    JOIN store.process AS p ON s.process_id = p.process_id
    LEFT JOIN host_begin AS h ON p.host_id = h.host_id
),
-- Each stamp on the host of each process that could have sent it.
sent AS (
    SELECT
        o.take_id, s.process_id, s.created_ns, s.last_seen_ns, s.begin_ns, s.is_stampless,
        o.stamp_ns + coalesce(h.shift_ns, 0) AS at_ns,
        o.stamp_ns + coalesce(h.shift_ns, 0) + 1_000_000 AS until_ns
    FROM orphan AS o
    JOIN sender AS s ON o.topic_name IS NOT DISTINCT FROM s.topic_name
    ASOF LEFT JOIN (SELECT * FROM derive.stamp_shift WHERE run_id = of_run) AS h
        ON s.host_id = h.host_id AND o.stamp_ns >= h.from_ns
    WHERE o.stamp_ns IS NOT NULL
),
judged AS (
    SELECT
        s.take_id,
        bool_and(s.at_ns < s.begin_ns) AS is_before_tracing,
        bool_or(coalesce(g.covered_until_ns >= s.at_ns - 1_000_000, false)) AS has_gap,
        bool_and(s.last_seen_ns < s.at_ns) AS has_none_left,
        bool_or(s.last_seen_ns < s.at_ns) AS has_ended,
        bool_or(s.is_stampless AND s.created_ns <= s.at_ns) AS has_stampless
    FROM sent AS s
    ASOF LEFT JOIN (SELECT * FROM derive.process_gap WHERE run_id = of_run) AS g
        ON s.process_id = g.process_id AND s.until_ns >= g.start_ns
    GROUP BY s.take_id
)
SELECT
    of_run::BIGINT AS run_id,
    o.take_id,
    o.subscription_id,
    CASE
        WHEN o.stamp_ns IS NULL THEN 'no_stamp'
        WHEN coalesce(
            j.is_before_tracing, o.stamp_ns < (SELECT min(begin_ns) FROM host_begin)
        ) THEN 'before_tracing'
        WHEN j.has_gap THEN 'publisher_gap'
        WHEN j.has_none_left THEN 'publisher_trace_ends'
        WHEN o.take_id IN (
            SELECT take_id FROM derive.take_candidate(of_run)
        ) OR (o.topic_name, o.stamp_ns) IN (
            SELECT (topic_name, source_timestamp_ns)
            FROM store.nearest_message
            WHERE run_id = of_run AND publication_id IS NULL
        ) THEN 'ambiguous'
        WHEN j.take_id IS NULL OR NOT (j.has_ended OR j.has_stampless)
            THEN 'publisher_not_traced'
        ELSE 'unknown'
    END AS reason
FROM orphan AS o
LEFT JOIN judged AS j ON o.take_id = j.take_id
