-- description: Links that overlap a window: messages from the end of their publication to the take,
--     publications in the callback instance they came from, and indirect links from the end of the
--     callback instance with the input to the publication. Doubtful effects of a take are left out.
-- grain: one row per link
-- param: first_take BIGINT  As in window_ids.sql
-- param: last_take BIGINT  As in window_ids.sql
-- param: first_publication BIGINT  As in window_ids.sql
-- param: last_publication BIGINT  As in window_ids.sql
-- param: last_instance BIGINT  As in window_ids.sql
-- param: limit BIGINT {1..50000} = 50000  Most links
-- column: link_kind UTINYINT  0 transport, 1 direct, 2 periodic_async, 3 partial_sync,
--     4 take_adjacent, 5 polled, 6 approximate_sync, 7 queue
-- column: from_row BIGINT  Row of the timeline where the arrow begins
-- column: to_row BIGINT  Row where it ends
-- column: from_at BIGINT [ns since origin]  Begin
-- column: to_at BIGINT [ns since origin]  End
-- column: is_loss_affected BOOLEAN  Lost events may hide a better partner
WITH message AS (
    SELECT
        0::UTINYINT AS link_kind,
        8 * b.publisher_id + 4 AS from_row,
        8 * t.subscription_id + 1 AS to_row,
        b.end_ns AS from_ns,
        t.taken_ns AS to_ns,
        coalesce(l.is_loss_affected, false) AS is_loss_affected
    FROM main.link_transport AS l
    JOIN main.publication AS b ON l.publication_id = b.publication_id
    JOIN main.take AS t ON l.take_id = t.take_id
    WHERE l.run_id = $run
        AND (l.take_id >= $first_take OR l.publication_id >= $first_publication)
        AND (l.take_id <= $last_take OR l.publication_id <= $last_publication)
),
cause AS (
    SELECT
        CASE l.kind WHEN 'direct' THEN 1 WHEN 'periodic_async' THEN 2 WHEN 'partial_sync' THEN 3
            WHEN 'take_adjacent' THEN 4 WHEN 'polled' THEN 5 WHEN 'queue' THEN 7 ELSE 6
            END::UTINYINT AS link_kind,
        coalesce(r.row_key, 8 * t.subscription_id + 1) AS from_row,
        coalesce(8 * b.publisher_id + 4, 8 * b.process_id + 7) AS to_row,
        CASE WHEN l.kind = 'direct' THEN b.start_ns
            ELSE coalesce(i.end_ns, i.start_ns, t.taken_ns) END AS from_ns,
        b.start_ns AS to_ns,
        coalesce(l.is_loss_affected, false) AS is_loss_affected
    FROM main.link_causal AS l
    JOIN main.publication AS b ON l.publication_id = b.publication_id
    LEFT JOIN main.callback_instance AS i ON l.callback_instance_id = i.callback_instance_id
    LEFT JOIN callback_row AS r ON i.callback_id = r.callback_id
    LEFT JOIN main.take AS t ON l.take_id = t.take_id
    WHERE l.run_id = $run AND l.publication_id >= $first_publication
        AND l.is_followed
        AND CASE WHEN l.kind = 'direct' THEN l.publication_id <= $last_publication
            WHEN l.callback_instance_id IS NULL THEN l.take_id <= $last_take
            ELSE l.callback_instance_id <= $last_instance END
)
SELECT
    link_kind, from_row, to_row,
    from_ns - $origin_ns AS from_at,
    to_ns - $origin_ns AS to_at,
    is_loss_affected
FROM (FROM message UNION ALL FROM cause)
WHERE from_row IS NOT NULL AND to_row IS NOT NULL
    AND least(from_ns, to_ns) < $end_ns AND greatest(from_ns, to_ns) >= $start_ns
ORDER BY from_at, to_at, link_kind, from_row, to_row
LIMIT $limit
