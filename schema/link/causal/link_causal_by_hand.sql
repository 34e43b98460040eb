-- description: Publications caused by messages that no callback was called with: what a thread
--     publishes after such a take (`take_adjacent`), and what a callback instance publishes after
--     it (`polled`). A publication that may be no answer to the message before it has one candidate
--     more: nothing. The same holds if the thread slept between the take and the publication, where
--     a kernel trace shows that: it probably waited for something else. Files of links may declare
--     that a publisher answers a subscription (`direct`). Then there is no doubt.
-- grain: one row per take, and publication that it caused
-- when: derive.take_by_hand
CREATE OR REPLACE MACRO derive.link_causal_by_hand(only_run) AS TABLE
WITH adjacent AS MATERIALIZED (FROM derive.link_causal_take_adjacent(only_run)),
-- Publications whose thread slept after the take: it then began something new.
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
        SELECT publication_id FROM derive.answer_to_call(only_run, 'adjacent')
        UNION
        SELECT publication_id FROM slept
    ) AS l
    JOIN adjacent AS a ON l.publication_id = a.publication_id
    ANTI JOIN (FROM derive.declared_pair WHERE run_id = only_run AND kind = 'direct') AS d
        ON a.subscription_id = d.subscription_id AND a.publisher_id = d.publisher_id
),
link AS (
    SELECT
        a.run_id,
        NULL::BIGINT AS callback_instance_id,
        a.take_id, a.publication_id, a.publisher_id,
        'take_adjacent' AS kind,
        NULL::BIGINT AS annotation_id,
        CASE WHEN d.publication_id IS NULL THEN 1 ELSE 2 END AS candidate_count,
        t.is_loss_affected OR b.is_loss_affected AS is_loss_affected
    FROM adjacent AS a
    LEFT JOIN doubtful AS d ON a.publication_id = d.publication_id
    JOIN store.take AS t ON a.take_id = t.take_id
    JOIN store.publication AS b ON a.publication_id = b.publication_id
    WHERE t.run_id = only_run AND b.run_id = only_run
    UNION ALL
    SELECT run_id, NULL, take_id, publication_id, publisher_id, 'polled', NULL, 1, is_loss_affected
    FROM derive.link_causal_polled(only_run)
)
FROM derive.causal_link(only_run, 'link')
