-- description: Messages matched by equal, non-zero source stamps, and equal topics where both are
--     known, whether from their own initialisation, or from other messages of the two or a file of
--     links (then `exact_stamp`). If the topic of a side is not known, the pair counts only if the
--     stamp has a single candidate in the run, and if the pair does not put one publication on two
--     topics. If several publications have the same topic and stamp, the k-th belongs to the k-th
--     such take of a subscription, so that none is received twice. If there are more such takes
--     than publications, some publications were lost, and each take may be of one of those. Equal
--     values need no clocks: a take may seem to come before its publication. A stamp that more than
--     64 publications have is that of no message: a damaged trace has it.
-- grain: one row per take whose publication is known by its stamp
-- param: has_unnamed BOOLEAN = true  Some topic is not known; false: none is looked for
CREATE OR REPLACE MACRO derive.link_transport_exact(only_run, has_unnamed := true) AS TABLE
WITH unnamed AS (
    SELECT
        kind, id,
        'group ' || group_id AS topic_name
    FROM derive.topic_group(only_run)
    WHERE has_unnamed AND topic_name IS NULL
),
repeated_publication AS (
    SELECT
        source_timestamp_ns,
        count(*) AS number
    FROM store.publication
    WHERE run_id = only_run AND source_timestamp_ns <> 0
    GROUP BY source_timestamp_ns
    HAVING count(*) > 1
),
published AS (
    SELECT
        b.publication_id, b.publisher_id, b.source_timestamp_ns, b.start_event_id,
        coalesce(p.topic_name, g.topic_name) AS topic_name,
        p.topic_name IS NOT NULL
        AND NOT coalesce(p.is_topic_learned OR p.is_topic_declared, false) AS is_own_topic
    FROM store.publication AS b
    LEFT JOIN store.publisher AS p ON b.publisher_id = p.publisher_id
    LEFT JOIN unnamed AS g ON b.publisher_id = g.id AND g.kind = 'publisher'
    ANTI JOIN (FROM repeated_publication WHERE number > 64) AS q
        ON b.source_timestamp_ns = q.source_timestamp_ns
    WHERE b.run_id = only_run AND b.source_timestamp_ns <> 0
),
received AS (
    SELECT
        t.run_id, t.take_id, t.source_timestamp_ns, t.subscription_id, t.start_event_id,
        coalesce(s.topic_name, g.topic_name) AS topic_name,
        s.topic_name IS NOT NULL
        AND NOT coalesce(s.is_topic_learned OR s.is_topic_declared, false) AS is_own_topic
    FROM store.take AS t
    LEFT JOIN store.subscription AS s ON t.subscription_id = s.subscription_id
    LEFT JOIN unnamed AS g ON t.subscription_id = g.id AND g.kind = 'subscription'
    WHERE t.run_id = only_run AND t.source_timestamp_ns <> 0
),
repeated_take AS (
    SELECT subscription_id, source_timestamp_ns
    FROM store.take
    WHERE run_id = only_run AND source_timestamp_ns <> 0
    GROUP BY subscription_id, source_timestamp_ns
    HAVING count(*) > 1
),
candidate AS (
    SELECT
        r.run_id, r.take_id, r.subscription_id, r.source_timestamp_ns,
        r.start_event_id AS take_event_id,
        p.publication_id, p.publisher_id,
        p.start_event_id AS publication_event_id,
        r.topic_name AS take_topic,
        coalesce(r.topic_name = p.topic_name, false) AS is_topic_known,
        CASE WHEN r.is_own_topic AND p.is_own_topic THEN 'exact' ELSE 'exact_stamp' END AS method,
        q.source_timestamp_ns IS NOT NULL OR u.source_timestamp_ns IS NOT NULL AS is_repeated
    FROM received AS r
    JOIN published AS p
        ON r.source_timestamp_ns = p.source_timestamp_ns
        AND coalesce(r.topic_name = p.topic_name, true)
    LEFT JOIN repeated_publication AS q ON r.source_timestamp_ns = q.source_timestamp_ns
    LEFT JOIN repeated_take AS u
        ON r.subscription_id IS NOT DISTINCT FROM u.subscription_id
        AND r.source_timestamp_ns = u.source_timestamp_ns
),
-- Nearly all messages are plain: only the others are worth counting and ordering.
counted AS (
    SELECT
        run_id, take_id, subscription_id, source_timestamp_ns, take_event_id, publication_id,
        publisher_id, publication_event_id, is_topic_known, method,
        count(*) OVER same_take AS candidate_count,
        count(CASE WHEN is_topic_known THEN 1 END) OVER same_take AS known_count,
        min(take_topic) OVER same_publication IS DISTINCT FROM max(take_topic)
            OVER same_publication AS has_several_topics
    FROM candidate
    WHERE is_repeated OR NOT is_topic_known
    WINDOW
        same_take AS (PARTITION BY run_id, take_id),
        same_publication AS (PARTITION BY run_id, publication_id)
),
unknown_topic AS (
    SELECT run_id, publication_id, take_id, publisher_id, subscription_id
    FROM counted
    WHERE known_count = 0 AND candidate_count = 1 AND NOT has_several_topics
),
ordered AS (
    SELECT
        run_id, publication_id, take_id, publisher_id, subscription_id, method, known_count,
        row_number() OVER (
            PARTITION BY run_id, take_id ORDER BY publication_event_id
        ) AS publication_position,
        dense_rank() OVER (
            PARTITION BY run_id, subscription_id, source_timestamp_ns ORDER BY take_event_id
        ) AS take_position,
        count(DISTINCT take_id) OVER (
            PARTITION BY run_id, subscription_id, source_timestamp_ns
        ) AS take_count
    FROM counted
    WHERE is_topic_known
)
SELECT
    run_id, publication_id, take_id, publisher_id, subscription_id, method,
    1::BIGINT AS candidate_count,
    false AS is_loss_affected
FROM candidate
WHERE is_topic_known AND NOT is_repeated
UNION ALL
SELECT
    run_id, publication_id, take_id, publisher_id, subscription_id, method,
    greatest(known_count, take_count),
    false
FROM ordered
WHERE publication_position = take_position
UNION ALL
SELECT run_id, publication_id, take_id, publisher_id, subscription_id, 'exact_stamp', 1, false
FROM unknown_topic
