-- description: Layers of calls, those of one call under one number. Each layer names those that it
--     `follows`. It continues a call only if it directly follows one of them on the thread, with no
--     gap between, and was given the same message. A stamp has no message. `layers` is the name of
--     a table with the layers: the first and last event of each, and what preceded the first.
-- grain: one row per layer
CREATE OR REPLACE MACRO staging.call(layers) AS TABLE
WITH layer AS (
    SELECT
        * EXCLUDE (previous_call_event_id),
        CASE
            WHEN event_id NOT IN (
                SELECT event_id FROM staging.near_gap WHERE sequence = 'call' AND is_behind
            )
                THEN previous_call_event_id
        END AS previous_event_id
    FROM query_table(layers)
),
linked AS (
    SELECT
        *,
        coalesce(
            previous_event_id = lag(coalesce(last_event_id, event_id)) OVER on_thread
            AND list_contains(follows, lag(layer) OVER on_thread)
            AND (layer = 'stamp' OR message = lag(message) OVER on_thread),
            false
        ) AS is_continued
    FROM layer
    WINDOW on_thread AS (PARTITION BY thread_index ORDER BY event_id)
)
SELECT
    *,
    sum((NOT is_continued)::INTEGER) OVER (PARTITION BY thread_index ORDER BY event_id)
        AS call_number
FROM linked
