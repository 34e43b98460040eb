-- description: Messages that wait in a queue until a thread of the node has worked them off, first
--     in, first out, as annotations of the kind `queue` tell: each publication by an output answers
--     the oldest message that none answered yet. Where the queue holds no more than `queue_depth`,
--     the oldest ones go: when the thread publishes, it takes the oldest of the last messages that
--     had come by then. A publication for which no message is left answers none. It shows that the
--     count was wrong until then: the links before it have two candidates. So have links where a
--     depth would leave too few messages for the publications that follow, all links of a
--     subscription whose creation was not traced, since messages may have waited already, those
--     behind a gap, where a message may be missing, and all where several threads publish outside
--     of callbacks: one may overtake the other.
-- grain: one row per annotation, input, and publication by one of its outputs that answers it
-- param: publications VARCHAR  Name of the rows of derive.annotated_publication
-- param: runs VARCHAR  Name of the rows of derive.annotated_run
CREATE OR REPLACE MACRO derive.link_causal_queue(only_run, publications, runs) AS TABLE
WITH message AS (
    SELECT
        a.annotation_id, a.queue_depth, r.subscription_id, r.callback_instance_id, r.thread_id,
        r.start_event_id,
        s.created_ns IS NULL AS is_old,
        row_number() OVER (
            PARTITION BY a.annotation_id, r.subscription_id ORDER BY r.start_event_id
        ) AS number
    FROM store.annotation AS a
    JOIN store.annotation_input AS i ON a.annotation_id = i.annotation_id
    JOIN query_table(runs) AS r ON i.subscription_id = r.subscription_id
    JOIN store.subscription AS s ON i.subscription_id = s.subscription_id
    WHERE a.run_id = only_run AND a.kind = 'queue'
),
published AS (
    SELECT
        b.*,
        i.subscription_id AS input_id,
        row_number() OVER (
            PARTITION BY b.annotation_id, i.subscription_id, b.publisher_id
            ORDER BY b.start_event_id
        ) AS number
    FROM query_table(publications) AS b
    JOIN store.annotation_input AS i ON b.annotation_id = i.annotation_id
    WHERE b.kind = 'queue' AND b.subscription_id IS DISTINCT FROM i.subscription_id
),
-- How many messages had come, and how many publications too many there were.
counted AS (
    SELECT
        p.*, m.queue_depth,
        coalesce(m.number, 0) AS come_count,
        greatest(0, max(p.number - coalesce(m.number, 0)) OVER so_far) AS surplus_count,
        greatest(0, max(p.number - coalesce(m.number, 0)) OVER of_all) AS last_surplus_count,
        min(CASE WHEN p.callback_instance_id IS NULL THEN p.thread_id END) OVER of_all
        <> max(CASE WHEN p.callback_instance_id IS NULL THEN p.thread_id END) OVER of_all
            AS is_unordered
    FROM published AS p
    ASOF LEFT JOIN message AS m
        ON p.annotation_id = m.annotation_id
        AND p.input_id = m.subscription_id
        AND p.start_event_id > m.start_event_id
    WINDOW of_all AS (PARTITION BY p.annotation_id, p.input_id, p.publisher_id),
    so_far AS (
        PARTITION BY p.annotation_id, p.input_id, p.publisher_id
        ORDER BY p.start_event_id ROWS UNBOUNDED PRECEDING
    )
),
answer AS (
    SELECT
        *,
        number - surplus_count AS answer_number,
        lag(come_count) OVER in_order AS come_before_count
    FROM counted
    WINDOW in_order AS (PARTITION BY annotation_id, input_id, publisher_id ORDER BY start_event_id)
    -- One too many has the number of the one before.
    QUALIFY row_number() OVER (
        PARTITION BY annotation_id, input_id, publisher_id, number - surplus_count
        ORDER BY start_event_id
    ) = 1
),
-- What a full queue lost moves all later answers on: not further than to where each of them still
-- has a message.
moved AS (
    SELECT
        *,
        greatest(
            0, max(come_before_count - queue_depth + 1 - answer_number) OVER (
                PARTITION BY annotation_id, input_id, publisher_id
                ORDER BY start_event_id ROWS UNBOUNDED PRECEDING
            )
        ) AS lost_count,
        min(come_count - answer_number) OVER (
            PARTITION BY annotation_id, input_id, publisher_id
            ORDER BY start_event_id ROWS BETWEEN CURRENT ROW AND UNBOUNDED FOLLOWING
        ) AS most_count
    FROM answer
),
broken AS (
    SELECT
        thread_id,
        min(resumed_event_id) AS event_id
    FROM store.thread_break
    WHERE run_id = only_run
    GROUP BY thread_id
)
SELECT
    p.run_id, p.annotation_id, p.kind, p.publication_id, m.callback_instance_id,
    CASE
        WHEN m.is_old OR p.is_unordered OR p.surplus_count < p.last_surplus_count
            OR p.lost_count > p.most_count
            OR least(k.event_id, o.event_id) <= p.start_event_id THEN 2
        ELSE 1
    END AS candidate_count,
    p.trace_id, p.thread_id, p.start_ns, p.start_event_id
FROM moved AS p
JOIN message AS m
    ON p.annotation_id = m.annotation_id
    AND p.input_id = m.subscription_id
    AND p.answer_number + least(p.lost_count, p.most_count) = m.number
LEFT JOIN broken AS k ON m.thread_id = k.thread_id
LEFT JOIN broken AS o ON p.thread_id = o.thread_id
