-- description: Messages of the sets that approximately synchronous annotations publish. A
--     publication inside a callback instance of an input is a firing: that instance showed that a
--     set is complete (derive.approximate_set). Its pivot is the latest of the first messages of
--     the inputs that came after the set of the firing before; if several sets became complete,
--     that decides. A link has one candidate if the firing, the firing before and the stamps leave
--     one set. It has two if nothing became complete at the firing but earlier, if the firing
--     before leaves several or another one, if a publisher published more than once, which may be a
--     second set, or if headers that are older than the publication would make another set.
--     `since_ns`: from when on a message that is missing might have changed the choice.
-- grain: one row per annotation, publication of a firing, and input
-- param: publications VARCHAR  Name of the rows of derive.annotated_publication
-- param: runs VARCHAR  Name of the rows of derive.annotated_run
CREATE OR REPLACE MACRO derive.link_causal_approximate(only_run, publications, runs) AS TABLE
WITH filtered AS MATERIALIZED (FROM derive.approximate_message(only_run, runs)),
published AS MATERIALIZED (
    SELECT
        b.run_id, b.annotation_id, b.kind, b.publication_id, b.trace_id, b.thread_id, b.start_ns,
        b.start_event_id, b.cut_event_id,
        count(*) OVER (
            PARTITION BY b.annotation_id, b.cut_event_id, p.publisher_id
        ) AS publication_count
    FROM query_table(publications) AS b
    JOIN store.annotation_input AS i
        ON b.annotation_id = i.annotation_id AND b.subscription_id = i.subscription_id
    JOIN store.publication AS p ON b.publication_id = p.publication_id
    WHERE p.run_id = only_run
),
firing AS (
    SELECT
        annotation_id, cut_event_id,
        lag(cut_event_id) OVER (
            PARTITION BY annotation_id ORDER BY cut_event_id
        ) AS previous_event_id
    FROM published
    GROUP BY annotation_id, cut_event_id
),
member AS MATERIALIZED (FROM derive.approximate_set(only_run, 'filtered')),
made AS MATERIALIZED (
    SELECT
        annotation_id, pivot_id, pivot_ns, proof_event_id, since_ns, is_close,
        list(callback_instance_id ORDER BY subscription_id) AS message_ids
    FROM member
    GROUP BY annotation_id, pivot_id, pivot_ns, proof_event_id, since_ns, is_close
),
-- What became complete last, after the firing before.
complete AS MATERIALIZED (
    SELECT
        f.annotation_id, f.cut_event_id, f.previous_event_id, m.proof_event_id,
        m.first_pivot_id, m.set_count, m.since_ns
    FROM firing AS f
    ASOF JOIN (
        SELECT
            annotation_id, proof_event_id,
            arg_min(pivot_id, (pivot_ns, pivot_id)) AS first_pivot_id,
            count(DISTINCT message_ids) AS set_count,
            min(since_ns) AS since_ns
        FROM made
        GROUP BY annotation_id, proof_event_id
    ) AS m
        ON f.annotation_id = m.annotation_id AND f.cut_event_id >= m.proof_event_id
    WHERE m.proof_event_id > coalesce(f.previous_event_id, 0)
),
-- The firing before used up at least and at most these; before the first one nothing is used.
used AS (
    SELECT
        c.annotation_id, c.cut_event_id, m.subscription_id,
        unnest([min(m.stamp_ns), max(m.stamp_ns)]) AS used_ns,
        unnest([1, 2]) AS reading
    FROM complete AS c
    JOIN complete AS b ON c.annotation_id = b.annotation_id AND c.previous_event_id = b.cut_event_id
    JOIN member AS m ON b.annotation_id = m.annotation_id AND b.proof_event_id = m.proof_event_id
    GROUP BY c.annotation_id, c.cut_event_id, m.subscription_id
    UNION ALL
    SELECT
        c.annotation_id, c.cut_event_id, i.subscription_id, 0,
        unnest([1, 2])
    FROM complete AS c
    JOIN store.annotation_input AS i ON c.annotation_id = i.annotation_id
    WHERE c.previous_event_id IS NULL
),
expected AS (
    SELECT
        u.annotation_id, u.cut_event_id, u.reading,
        arg_max(f.callback_instance_id, (f.stamp_ns, f.callback_instance_id)) AS pivot_id
    FROM used AS u
    ASOF JOIN filtered AS f
        ON u.annotation_id = f.annotation_id
        AND u.subscription_id = f.subscription_id
        AND u.used_ns < f.stamp_ns
    GROUP BY u.annotation_id, u.cut_event_id, u.reading
),
decided AS (
    SELECT
        c.annotation_id, c.cut_event_id,
        max_by(m.pivot_id, e.reading) AS pivot_id,
        any_value(c.set_count) = 1 OR count(*) = 2 AND count(DISTINCT m.message_ids) = 1
            AS is_certain
    FROM complete AS c
    JOIN expected AS e ON c.annotation_id = e.annotation_id AND c.cut_event_id = e.cut_event_id
    JOIN made AS m
        ON e.annotation_id = m.annotation_id
        AND e.pivot_id = m.pivot_id
        AND c.proof_event_id = m.proof_event_id
    GROUP BY c.annotation_id, c.cut_event_id
),
chosen AS MATERIALIZED (
    SELECT
        c.annotation_id, c.cut_event_id,
        coalesce(d.pivot_id, c.first_pivot_id) AS pivot_id,
        c.since_ns,
        c.set_count > 1 AS may_be_two,
        c.proof_event_id = c.cut_event_id
        AND (c.set_count = 1 OR c.previous_event_id IS NOT NULL)
        AND coalesce(d.is_certain, false) AS is_certain
    FROM complete AS c
    LEFT JOIN decided AS d ON c.annotation_id = d.annotation_id AND c.cut_event_id = d.cut_event_id
)
SELECT
    b.run_id, b.annotation_id, b.kind, b.publication_id, b.trace_id, b.thread_id, b.start_ns,
    b.start_event_id, m.callback_instance_id, c.since_ns,
    CASE
        WHEN c.is_certain AND NOT m.is_close AND (b.publication_count = 1 OR NOT c.may_be_two)
            THEN 1
        ELSE 2
    END AS candidate_count
FROM published AS b
JOIN chosen AS c ON b.annotation_id = c.annotation_id AND b.cut_event_id = c.cut_event_id
JOIN member AS m ON c.annotation_id = m.annotation_id AND c.pivot_id = m.pivot_id
