-- description: Firings of partially synchronous annotations: callback instances of an input that
--     publish on an output. All publications of one instance are one firing. It empties the
--     caches, at some moment between the start of the instance and its first publication.
--     `emptied_event_id`: the last publication of another firing before the first one of this; by
--     then the caches had been emptied. `kept_event_id`: the start of the last firing that had
--     published when this one began; what came after it may have been kept. `last_event_id`: its
--     own last publication.
-- grain: one row per annotation and callback instance of one of its inputs that fires it
-- param: publications VARCHAR  Name of the rows of derive.annotated_publication
CREATE OR REPLACE MACRO derive.partial_sync_firing(publications) AS TABLE
WITH published AS (
    SELECT
        b.annotation_id, b.callback_instance_id, b.cut_event_id, b.start_event_id,
        lag(b.start_event_id) OVER (
            PARTITION BY b.annotation_id ORDER BY b.start_event_id
        ) AS previous_event_id
    FROM query_table(publications) AS b
    JOIN store.annotation_input AS i
        ON b.annotation_id = i.annotation_id AND b.subscription_id = i.subscription_id
    WHERE b.kind = 'partial_sync'
),
fired AS (
    SELECT
        annotation_id, callback_instance_id, cut_event_id,
        min(start_event_id) AS first_event_id,
        max(start_event_id) AS last_event_id,
        arg_min_null(previous_event_id, start_event_id) AS emptied_event_id
    FROM published
    GROUP BY annotation_id, callback_instance_id, cut_event_id
),
earlier AS (
    SELECT
        annotation_id, first_event_id,
        max(cut_event_id) OVER (
            PARTITION BY annotation_id ORDER BY first_event_id ROWS UNBOUNDED PRECEDING
        ) AS kept_event_id
    FROM fired
)
SELECT
    f.annotation_id, f.callback_instance_id, f.first_event_id, f.last_event_id, f.emptied_event_id,
    e.kept_event_id
FROM fired AS f
ASOF LEFT JOIN earlier AS e
    ON f.annotation_id = e.annotation_id AND f.cut_event_id > e.first_event_id
