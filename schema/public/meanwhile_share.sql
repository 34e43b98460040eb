-- description: What ran while callbacks waited: the three with the largest share, with their node
--     if it is another one. Callbacks that answers count as one (main.callback_alike) are one.
-- grain: one row per callback that waited while others ran
-- param: waited VARCHAR  Name of waits: a table, or a part of the query, with callback_id, and
--     meanwhile_callback_ids and meanwhile_ns of main.executor_wait_explained
-- column: callback_id BIGINT  Callback that waited
-- column: shares VARCHAR  What ran, the largest first
CREATE OR REPLACE MACRO main.meanwhile_share(waited) AS TABLE
WITH pair AS (
    SELECT
        r.callback_id,
        k.alike_id AS meanwhile_id,
        sum(r.overlap_ns) AS overlap_ns
    FROM (
        SELECT
            callback_id,
            unnest(meanwhile_callback_ids) AS meanwhile_id,
            unnest(meanwhile_ns) AS overlap_ns
        FROM query_table(waited)
    ) AS r
    JOIN main.callback_alike AS k ON r.meanwhile_id = k.callback_id
    GROUP BY r.callback_id, k.alike_id
),
ranked AS (
    SELECT
        callback_id, meanwhile_id,
        overlap_ns / sum(overlap_ns) OVER (PARTITION BY callback_id) AS share,
        row_number() OVER (PARTITION BY callback_id ORDER BY overlap_ns DESC, meanwhile_id) AS place
    FROM pair
)
SELECT
    r.callback_id,
    string_agg(
        CASE WHEN o.node = l.node THEN '' ELSE o.node || ' ' END
        || printf('%s %.0f %%', o.label, 100 * r.share),
        ', ' ORDER BY r.place
    ) AS shares
FROM ranked AS r
JOIN main.callback_label AS l ON r.callback_id = l.callback_id
JOIN main.callback_label AS o ON r.meanwhile_id = o.callback_id
WHERE r.place <= 3 AND r.share >= 0.005
GROUP BY r.callback_id
