-- name: derive.link_causal_direct
-- description: Publications inside a run of a callback on its thread, from its start to its
--     effective end; of nested runs the innermost, by depth. Order decides, not time.
-- grain: one row per publication made inside a run of a callback
-- needs: store.publication, store.callback_instance
WITH step AS (
    SELECT run_id, thread_id, start_event_id AS event_id, 1 AS step, NULL::BIGINT AS publication_id
    FROM store.callback_instance
    UNION ALL
    SELECT run_id, thread_id, effective_end_event_id, -1, NULL
    FROM store.callback_instance
    UNION ALL
    SELECT run_id, thread_id, start_event_id, 0, publication_id
    FROM store.publication
),
level AS (
    SELECT
        run_id, thread_id, event_id, publication_id,
        sum(step) OVER (
            PARTITION BY run_id, thread_id ORDER BY event_id, step ROWS UNBOUNDED PRECEDING
        )::INTEGER AS depth
    FROM step
)
SELECT
    l.run_id,
    i.callback_instance_id,
    l.publication_id
FROM level AS l
ASOF JOIN store.callback_instance AS i
    ON l.run_id = i.run_id
    AND l.thread_id = i.thread_id
    AND l.depth = i.depth
    AND l.event_id > i.start_event_id
WHERE l.publication_id IS NOT NULL AND l.event_id < i.effective_end_event_id
