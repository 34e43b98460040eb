-- description: Publications inside a callback instance on its thread, from its start to its
--     effective end; of nested instances the innermost counts. The order of events decides, not
--     time. The last begin or end of a callback before the publication tells which instance that
--     is: the one that began there, unless it was over; else the nearest one around it that was
--     not over. Where the end of one inside was lost, it may have been that one: then there are two
--     candidates. What a later step of a call publishes is the first one's.
-- grain: one row per publication made inside a callback instance
CREATE OR REPLACE MACRO derive.link_causal_direct(only_run) AS TABLE
WITH RECURSIVE around AS (
    SELECT
        b.run_id, b.publication_id, b.publisher_id, b.is_loss_affected,
        b.start_event_id AS event_id,
        i.parent_id,
        i.end_event_id IS NULL AS is_doubtful
    FROM store.publication AS b
    JOIN store.callback_instance AS i ON b.callback_event_id = i.start_event_id
    WHERE b.run_id = only_run
        AND i.run_id = only_run
        AND i.parent_id IS NOT NULL
        AND b.start_event_id >= i.effective_end_event_id
    UNION ALL
    SELECT
        b.run_id, b.publication_id, b.publisher_id, b.is_loss_affected, b.start_event_id,
        i.parent_id, false
    FROM store.publication AS b
    JOIN store.callback_instance AS i ON b.callback_event_id = i.end_event_id
    WHERE b.run_id = only_run AND i.run_id = only_run AND i.parent_id IS NOT NULL
    UNION ALL
    SELECT
        a.run_id, a.publication_id, a.publisher_id, a.is_loss_affected, a.event_id, i.parent_id,
        a.is_doubtful OR i.end_event_id IS NULL
    FROM around AS a
    JOIN store.callback_instance AS i ON a.parent_id = i.callback_instance_id
    WHERE i.parent_id IS NOT NULL AND a.event_id >= i.effective_end_event_id
),
inside AS (
    SELECT
        b.run_id, i.continues_id, i.callback_instance_id, b.publication_id, i.take_id,
        b.publisher_id,
        i.is_loss_affected OR b.is_loss_affected AS is_loss_affected,
        1::BIGINT AS candidate_count
    FROM store.publication AS b
    JOIN store.callback_instance AS i ON b.callback_event_id = i.start_event_id
    WHERE b.run_id = only_run
        AND i.run_id = only_run
        AND b.start_event_id < i.effective_end_event_id
    UNION ALL
    SELECT
        a.run_id, i.continues_id, i.callback_instance_id, a.publication_id, i.take_id,
        a.publisher_id,
        i.is_loss_affected OR a.is_loss_affected,
        1 + a.is_doubtful::BIGINT
    FROM around AS a
    JOIN store.callback_instance AS i ON a.parent_id = i.callback_instance_id
    WHERE a.event_id < i.effective_end_event_id
)
SELECT
    d.run_id,
    coalesce(f.callback_instance_id, d.callback_instance_id) AS callback_instance_id,
    d.publication_id,
    coalesce(f.take_id, d.take_id) AS take_id,
    d.publisher_id, d.is_loss_affected, d.candidate_count
FROM inside AS d
LEFT JOIN (
    SELECT callback_instance_id, take_id
    FROM store.callback_instance
    WHERE run_id = only_run AND callback_instance_id IN (
        SELECT continues_id FROM store.callback_instance WHERE run_id = only_run
    )
) AS f ON d.continues_id = f.callback_instance_id
