-- name: derive.link_causal
-- kind: macro
-- description: What led to each publication, by every kind of link. A link may be spoilt by lost
--     events where a gap touches its callback instance, or its take, or its publication. In a
--     process that is several with equal ids, the cause may be one of another process. What may be
--     no answer to the message before it has one candidate more: nothing. So has what a thread
--     published after it slept since the take, where a kernel trace shows it: it probably waited
--     for something else in between. Files of links may
--     declare that a publisher answers a subscription (`direct`), or that it does not
--     (`independent`): then there is no doubt, or no link.
-- grain: one row per callback instance, or take without one, and publication that it led to, and
--     annotation of an indirect link
-- param: only_run BIGINT  Run to look at
CREATE OR REPLACE MACRO derive.link_causal(only_run) AS TABLE
WITH declared AS MATERIALIZED (
    SELECT a.kind, i.subscription_id, o.publisher_id
    FROM store.annotation AS a
    JOIN store.annotation_input AS i ON a.annotation_id = i.annotation_id
    JOIN store.annotation_output AS o ON a.annotation_id = o.annotation_id
    WHERE a.run_id = only_run AND a.kind IN ('direct', 'independent', 'approximate_sync')
),
adjacent AS MATERIALIZED (
    FROM derive.link_causal_take_adjacent(only_run)
),
-- A thread that waits begins a new turn: the last sleep before the publication tells.
slept AS (
    SELECT a.publication_id
    FROM adjacent AS a
    ASOF JOIN (
        SELECT thread_id, start_ns, end_ns
        FROM store.thread_state
        WHERE run_id = only_run AND state = 'sleeping'
    ) AS s ON a.thread_id = s.thread_id AND a.start_ns >= s.end_ns
    WHERE s.start_ns >= a.taken_ns
),
doubtful AS (
    SELECT l.publication_id
    FROM (
        SELECT publication_id FROM derive.answer_doubtful(only_run, 'adjacent')
        UNION
        SELECT publication_id FROM slept
    ) AS l
    JOIN adjacent AS a ON l.publication_id = a.publication_id
    ANTI JOIN (SELECT subscription_id, publisher_id FROM declared WHERE kind = 'direct') AS d
        ON a.subscription_id = d.subscription_id AND a.publisher_id = d.publisher_id
),
link AS (
    SELECT
        run_id, callback_instance_id, take_id, publication_id, publisher_id, 'direct' AS kind,
        NULL::BIGINT AS annotation_id, 1::BIGINT AS candidate_count, is_loss_affected
    FROM derive.link_causal_direct(only_run)
    UNION ALL
    SELECT
        a.run_id, NULL, a.take_id, a.publication_id, a.publisher_id, 'take_adjacent', NULL,
        CASE WHEN d.publication_id IS NULL THEN 1 ELSE 2 END,
        t.is_loss_affected OR b.is_loss_affected
    FROM adjacent AS a
    LEFT JOIN doubtful AS d ON a.publication_id = d.publication_id
    JOIN store.take AS t ON a.take_id = t.take_id
    JOIN store.publication AS b ON a.publication_id = b.publication_id
    WHERE t.run_id = only_run AND b.run_id = only_run
    UNION ALL
    SELECT
        run_id, NULL, take_id, publication_id, publisher_id, 'polled', NULL, 1, is_loss_affected
    FROM derive.link_causal_polled(only_run)
    UNION ALL
    SELECT
        x.run_id, x.callback_instance_id, i.take_id, x.publication_id, b.publisher_id, x.kind,
        x.annotation_id, x.candidate_count,
        x.is_loss_affected OR i.is_loss_affected OR b.is_loss_affected
    FROM derive.link_causal_indirect(only_run) AS x
    JOIN store.callback_instance AS i ON x.callback_instance_id = i.callback_instance_id
    JOIN store.publication AS b ON x.publication_id = b.publication_id
    WHERE i.run_id = only_run AND b.run_id = only_run
),
mixed AS (
    SELECT publication_id
    FROM store.publication
    WHERE run_id = only_run
        AND process_id IN (SELECT process_id FROM store.process WHERE is_ambiguous)
)
SELECT
    l.run_id,
    l.callback_instance_id,
    l.publication_id,
    l.take_id,
    t.subscription_id,
    l.publisher_id,
    l.kind,
    l.annotation_id,
    greatest(
        l.candidate_count, CASE WHEN m.publication_id IS NOT NULL THEN 2 END
    ) AS candidate_count,
    coalesce(l.is_loss_affected, false) AS is_loss_affected
FROM link AS l
LEFT JOIN store.take AS t ON l.take_id = t.take_id AND t.run_id = only_run
LEFT JOIN mixed AS m ON l.publication_id = m.publication_id
ANTI JOIN (
    SELECT
        subscription_id, publisher_id,
        unnest(CASE kind WHEN 'independent' THEN ['direct', 'take_adjacent'] ELSE ['direct'] END)
            AS kind
    FROM declared
    WHERE kind <> 'direct'
) AS d
    ON l.kind = d.kind
    AND t.subscription_id = d.subscription_id
    AND l.publisher_id = d.publisher_id
