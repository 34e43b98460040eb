-- name: links
-- title: Arrows of the timeline
-- description: Links that overlap a window: messages from the end of their publication to the take,
--     publications in the callback instance they came from, and indirect links from the end of the
--     callback instance with the input to the publication.
-- grain: one row per link
-- param: run BIGINT  Run
-- param: origin_ns BIGINT  What times count from, epoch ns
-- param: start_ns BIGINT  Begin of the window, epoch ns
-- param: end_ns BIGINT  Its end, epoch ns, exclusive
-- param: recorded_from_ns BIGINT  Begin of the window on the earliest clock
-- param: recorded_before_ns BIGINT  Its end on the latest clock
-- param: limit BIGINT = 50000  Most links
-- column: link_kind UTINYINT  0 transport, 1 direct, 2 periodic_async, 3 partial_sync,
--     4 take_adjacent
-- column: from_row BIGINT  Row of the timeline where the arrow begins
-- column: to_row BIGINT  Row where it ends
-- column: from_at BIGINT [ns since origin]  Begin
-- column: to_at BIGINT [ns since origin]  End
-- column: is_loss_affected BOOLEAN  Lost events may hide a better partner

-- Identities follow time on the clocks as recorded. What overlaps the window is found by them, and
-- joined with times afterwards: joined first, all that was before it would be held in memory.
WITH bound AS (
    SELECT
        (SELECT min(take_id) FROM store.take
            WHERE run_id = $run AND taken_ns >= $recorded_from_ns) AS first_take,
        (SELECT max(take_id) FROM store.take
            WHERE run_id = $run AND taken_ns < $recorded_before_ns) AS last_take,
        (SELECT min(publication_id) FROM store.publication
            WHERE run_id = $run AND start_ns >= $recorded_from_ns) AS first_publication,
        (SELECT max(publication_id) FROM store.publication
            WHERE run_id = $run AND start_ns < $recorded_before_ns) AS last_publication,
        (SELECT max(callback_instance_id) FROM store.callback_instance
            WHERE run_id = $run AND start_ns < $recorded_before_ns) AS last_instance
),
near_message AS MATERIALIZED (
    SELECT
        l.publication_id, l.take_id, l.publisher_id, l.subscription_id, l.is_loss_affected
    FROM store.link_transport AS l
    JOIN bound AS n ON l.take_id >= n.first_take AND l.publication_id <= n.last_publication
    WHERE l.run_id = $run
),
near_cause AS MATERIALIZED (
    SELECT
        l.callback_instance_id, l.publication_id, l.take_id, l.subscription_id, l.kind,
        l.is_loss_affected
    FROM store.link_causal AS l
    JOIN bound AS n ON l.publication_id >= n.first_publication
        AND CASE WHEN l.kind = 'direct' THEN l.publication_id <= n.last_publication
            WHEN l.callback_instance_id IS NULL THEN l.take_id <= n.last_take
            ELSE l.callback_instance_id <= n.last_instance END
    WHERE l.run_id = $run
),
message AS (
    SELECT
        0::UTINYINT AS link_kind,
        8 * l.publisher_id + 4 AS from_row,
        8 * l.subscription_id + 1 AS to_row,
        b.process_id AS from_process_id,
        t.process_id AS to_process_id,
        b.end_ns AS from_ns,
        t.taken_ns AS to_ns,
        coalesce(l.is_loss_affected, false) AS is_loss_affected
    FROM near_message AS l
    JOIN store.publication AS b ON l.publication_id = b.publication_id
    JOIN store.take AS t ON l.take_id = t.take_id
    WHERE b.end_ns < $recorded_before_ns AND t.taken_ns >= $recorded_from_ns
),
cause AS (
    SELECT
        CASE l.kind WHEN 'direct' THEN 1 WHEN 'periodic_async' THEN 2 WHEN 'partial_sync' THEN 3
            ELSE 4 END::UTINYINT AS link_kind,
        CASE c.kind
            WHEN 'timer' THEN coalesce(8 * c.timer_id, 8 * c.callback_id + 5)
            WHEN 'subscription' THEN coalesce(8 * c.subscription_id + 1, 8 * c.callback_id + 5)
            WHEN 'service' THEN coalesce(8 * c.service_id + 2, 8 * c.callback_id + 5)
            ELSE coalesce(8 * c.callback_id + 5, 8 * l.subscription_id + 1)
        END AS from_row,
        coalesce(8 * b.publisher_id + 4, 8 * b.process_id + 7) AS to_row,
        coalesce(i.process_id, t.process_id) AS from_process_id,
        b.process_id AS to_process_id,
        CASE WHEN l.kind = 'direct' THEN b.start_ns
            ELSE coalesce(i.end_ns, i.start_ns, t.taken_ns) END AS from_ns,
        b.start_ns AS to_ns,
        coalesce(l.is_loss_affected, false) AS is_loss_affected
    FROM near_cause AS l
    JOIN store.publication AS b ON l.publication_id = b.publication_id
    LEFT JOIN store.callback_instance AS i ON l.callback_instance_id = i.callback_instance_id
    LEFT JOIN store.callback AS c ON i.callback_id = c.callback_id
    LEFT JOIN store.take AS t ON l.take_id = t.take_id
    WHERE b.start_ns >= $recorded_from_ns
        AND CASE WHEN l.kind = 'direct' THEN b.start_ns
            ELSE coalesce(i.end_ns, i.start_ns, t.taken_ns) END < $recorded_before_ns
),
arrow AS (
    SELECT
        a.link_kind, a.from_row, a.to_row,
        derive.corrected_ns(a.from_ns, f.offset_ns, f.drift_ppb, f.reference_ns) AS from_ns,
        derive.corrected_ns(a.to_ns, t.offset_ns, t.drift_ppb, t.reference_ns) AS to_ns,
        a.is_loss_affected
    FROM (
        SELECT link_kind, from_row, to_row, from_process_id, to_process_id, from_ns, to_ns,
            is_loss_affected
        FROM message
        UNION ALL
        SELECT link_kind, from_row, to_row, from_process_id, to_process_id, from_ns, to_ns,
            is_loss_affected
        FROM cause
    ) AS a
    JOIN derive.process_clock AS f ON a.from_process_id = f.process_id
    JOIN derive.process_clock AS t ON a.to_process_id = t.process_id
    WHERE a.from_row IS NOT NULL AND a.to_row IS NOT NULL
)
SELECT
    link_kind, from_row, to_row, from_ns - $origin_ns AS from_at, to_ns - $origin_ns AS to_at,
    is_loss_affected
FROM arrow
WHERE least(from_ns, to_ns) < $end_ns AND greatest(from_ns, to_ns) >= $start_ns
ORDER BY from_at, to_at, link_kind, from_row, to_row
LIMIT $limit
