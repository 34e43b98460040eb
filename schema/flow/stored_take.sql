-- description: Takes of messages that were published before their subscription existed, and were
--     stored until then (a publisher that is transient local: latched). The creation of the
--     subscription decides, so a message that was only sent before the two were connected is not
--     among them. Nor is one that was sent so shortly before that it may have been on its way: its
--     publisher may be volatile, and the event of the creation comes behind it. Between clocks the
--     distance has to be more than the errors of both. ROS publishes /parameter_events as volatile.
-- grain: one row per such take
WITH clock AS (
    SELECT
        c.clock_id, c.reference_clock_id,
        coalesce(max(u.uncertainty_ns), c.uncertainty_ns) AS uncertainty_ns
    FROM store.clock AS c
    LEFT JOIN store.clock_uncertainty AS u ON c.clock_id = u.clock_id
    GROUP BY c.clock_id, c.reference_clock_id, c.uncertainty_ns
),
place AS (
    SELECT
        p.process_id, c.clock_id, c.reference_clock_id, c.uncertainty_ns, p.offset_ns, p.drift_ppb,
        p.reference_ns
    FROM derive.process_clock AS p
    JOIN clock AS c ON p.clock_id = c.clock_id
),
created AS (
    SELECT
        s.run_id, s.subscription_id, p.clock_id, p.reference_clock_id, p.uncertainty_ns,
        derive.corrected_ns(s.created_ns, p) AS created_ns
    FROM store.subscription AS s
    JOIN place AS p ON s.process_id = p.process_id
    WHERE s.topic_name IS DISTINCT FROM '/parameter_events'
),
-- Most publications are later than all creations: only the others are looked up.
latest AS (
    SELECT
        run_id,
        max(created_ns) AS created_ns
    FROM created
    GROUP BY run_id
),
sent AS (
    SELECT
        b.publication_id, p.clock_id, p.reference_clock_id, p.uncertainty_ns,
        derive.corrected_ns(b.end_ns, p) AS end_ns
    FROM store.publication AS b
    JOIN place AS p ON b.process_id = p.process_id
    JOIN latest AS n
        ON b.run_id = n.run_id
        AND derive.corrected_ns(b.end_ns, p) < n.created_ns
)
SELECT
    l.run_id, l.take_id, s.created_ns,
    s.created_ns - b.end_ns AS stored_ns
FROM store.link_transport AS l
JOIN sent AS b ON l.publication_id = b.publication_id
JOIN created AS s ON l.subscription_id = s.subscription_id
WHERE s.created_ns - b.end_ns - derive.delivery_limit().longest_ns > CASE
        WHEN b.clock_id = s.clock_id THEN 0
        WHEN b.reference_clock_id = s.reference_clock_id
            THEN b.uncertainty_ns + s.uncertainty_ns
    END
