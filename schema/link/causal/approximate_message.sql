-- description: Messages of the inputs of approximately synchronous annotations. The filter compares
--     the stamps in their headers, which are not in the trace: `stamp_ns`, when they were
--     published, stands for them. A header may be older, by up to `age_ns`: its node may have
--     stamped it when the publishing callback began, or copied the stamp of the message that the
--     callback got, and so on. Chains end where a publisher comes again. `age_ns` is NULL where a
--     header may come from a message that no callback was called with: an annotation leads to the
--     publication, or its callback, or its thread outside of callbacks, took messages itself.
-- grain: one row per annotation and callback instance of one of its inputs
-- param: runs VARCHAR  Name of the rows of derive.annotated_run
CREATE OR REPLACE MACRO derive.approximate_message(only_run, runs) AS TABLE
WITH RECURSIVE input AS MATERIALIZED (
    SELECT
        a.run_id, a.annotation_id, r.subscription_id, r.callback_instance_id, r.start_ns,
        r.start_event_id, c.take_id
    FROM store.annotation AS a
    JOIN store.annotation_input AS i ON a.annotation_id = i.annotation_id
    JOIN query_table(runs) AS r ON i.subscription_id = r.subscription_id
    JOIN store.callback_instance AS c ON r.callback_instance_id = c.callback_instance_id
    WHERE a.run_id = only_run AND a.kind = 'approximate_sync' AND c.run_id = only_run
),
-- Few recordings have such an annotation: those that have none are not looked through.
by_hand AS MATERIALIZED (
    SELECT thread_id, taken_ns
    FROM derive.take_by_hand(only_run)
    WHERE run_id IN (SELECT run_id FROM input)
),
instance AS (
    SELECT callback_instance_id, take_id, start_ns
    FROM store.callback_instance
    WHERE run_id IN (SELECT run_id FROM input)
),
taking AS MATERIALIZED (
    SELECT DISTINCT i.callback_instance_id
    FROM by_hand AS t
    JOIN store.callback_instance AS i
        ON t.thread_id = i.thread_id AND t.taken_ns BETWEEN i.start_ns AND i.end_ns
    WHERE i.run_id = only_run
),
sent AS MATERIALIZED (
    SELECT
        t.take_id, b.publisher_id,
        i.take_id AS cause_id,
        coalesce(nullif(t.source_timestamp_ns, 0), b.start_ns) AS stamp_ns,
        CASE
            WHEN
                o.publisher_id IS NULL AND g.callback_instance_id IS NULL
                AND (i.callback_instance_id IS NOT NULL OR h.thread_id IS NULL)
                THEN b.start_ns - coalesce(i.start_ns, b.start_ns)
        END AS working_ns
    FROM store.take AS t
    JOIN store.link_transport AS l ON t.take_id = l.take_id
    JOIN store.publication AS b ON l.publication_id = b.publication_id
    LEFT JOIN derive.link_causal_direct(only_run) AS d ON b.publication_id = d.publication_id
    LEFT JOIN instance AS i ON d.callback_instance_id = i.callback_instance_id
    LEFT JOIN (SELECT DISTINCT publisher_id FROM store.annotation_output) AS o
        ON b.publisher_id = o.publisher_id
    LEFT JOIN (SELECT DISTINCT thread_id FROM by_hand) AS h ON b.thread_id = h.thread_id
    LEFT JOIN taking AS g ON i.callback_instance_id = g.callback_instance_id
    WHERE t.run_id IN (SELECT run_id FROM input) AND l.run_id = only_run AND b.run_id = only_run
),
origin (take_id, cause_id, publisher_ids, made_ns) AS (
    SELECT
        s.take_id, s.cause_id,
        [s.publisher_id],
        s.stamp_ns - s.working_ns
    FROM sent AS s
    SEMI JOIN input AS i ON s.take_id = i.take_id
    UNION ALL
    SELECT
        o.take_id, s.cause_id,
        list_append(o.publisher_ids, s.publisher_id),
        s.stamp_ns - s.working_ns
    FROM origin AS o
    JOIN sent AS s ON o.cause_id = s.take_id
    WHERE NOT list_contains(o.publisher_ids, s.publisher_id)
),
made AS (
    SELECT
        take_id,
        CASE WHEN count(*) = count(made_ns) THEN min(made_ns) END AS made_ns
    FROM origin
    GROUP BY take_id
)
SELECT
    i.annotation_id, i.subscription_id, i.callback_instance_id, i.start_ns, i.start_event_id,
    coalesce(s.stamp_ns, t.source_timestamp_ns) AS stamp_ns,
    s.stamp_ns - m.made_ns AS age_ns
FROM input AS i
JOIN store.take AS t ON i.take_id = t.take_id AND t.run_id = only_run
LEFT JOIN sent AS s ON i.take_id = s.take_id
LEFT JOIN made AS m ON i.take_id = m.take_id
WHERE coalesce(s.stamp_ns, nullif(t.source_timestamp_ns, 0)) IS NOT NULL
-- Of equal stamps of an input the last counts.
QUALIFY lead(i.start_event_id) OVER (
    PARTITION BY i.annotation_id, i.subscription_id, coalesce(s.stamp_ns, t.source_timestamp_ns)
    ORDER BY i.start_event_id
) IS NULL
