-- name: main.stored_take
-- description: Takes of messages that were published before their subscription existed, and were
--     stored until then (a publisher that is transient local: latched). The creation of the
--     subscription decides, so a message that was only sent before the two were connected is not
--     among them. Between clocks the distance has to be more than the errors of both.
-- grain: one row per such take
-- column: run_id BIGINT  Run that the row belongs to
-- column: take_id BIGINT  Identity of the take
-- column: created_ns BIGINT [epoch ns]  Creation of its subscription
-- column: stored_ns BIGINT [ns]  From the end of the publication until then
WITH clock AS (
    SELECT
        c.clock_id, c.reference_clock_id,
        coalesce(max(u.uncertainty_ns), c.uncertainty_ns) AS uncertainty_ns
    FROM store.clock AS c
    LEFT JOIN store.clock_uncertainty AS u ON c.clock_id = u.clock_id
    GROUP BY c.clock_id, c.reference_clock_id, c.uncertainty_ns
),
place AS (
    SELECT p.process_id, c.clock_id, c.reference_clock_id, c.uncertainty_ns
    FROM store.process AS p
    JOIN store.host AS h ON p.host_id = h.host_id
    JOIN clock AS c ON h.clock_id = c.clock_id
),
-- Most publications are later than all creations: only the others are looked up.
latest AS (
    SELECT run_id, max(created_ns) AS created_ns FROM main.subscription GROUP BY run_id
),
sent AS (
    SELECT b.publication_id, b.process_id, b.end_ns
    FROM main.publication AS b
    JOIN latest AS n ON b.run_id = n.run_id AND b.end_ns < n.created_ns
)
SELECT l.run_id, l.take_id, s.created_ns, s.created_ns - b.end_ns AS stored_ns
FROM store.link_transport AS l
JOIN sent AS b ON l.publication_id = b.publication_id
JOIN main.subscription AS s ON l.subscription_id = s.subscription_id
JOIN place AS f ON b.process_id = f.process_id
JOIN place AS o ON s.process_id = o.process_id
WHERE s.created_ns - b.end_ns > CASE
        WHEN f.clock_id = o.clock_id THEN 0
        WHEN f.reference_clock_id = o.reference_clock_id
            THEN f.uncertainty_ns + o.uncertainty_ns
    END
