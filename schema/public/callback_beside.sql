-- description: Which callbacks of a process ran during stretches of time, and for how much of it.
--     Callbacks that answers count as one (main.callback_alike) are one.
-- grain: one row per id and callback that ran meanwhile
-- param: spans VARCHAR  Name of stretches: a table, or a part of the query, with id, process_id,
--     start_ns and end_ns; several may have one id
-- column: id BIGINT  Whose stretches
-- column: alike_id BIGINT  The first callback of those like it
-- column: share DOUBLE [share]  Share of the time of all stretches of the id for which it ran
CREATE OR REPLACE MACRO main.callback_beside(spans) AS TABLE
WITH total AS (
    SELECT
        id,
        sum(end_ns - start_ns) AS total_ns
    FROM query_table(spans)
    GROUP BY id
)
SELECT
    s.id, k.alike_id,
    sum(least(i.end_ns, s.end_ns) - greatest(i.start_ns, s.start_ns)) / any_value(t.total_ns)
        AS share
FROM query_table(spans) AS s
JOIN total AS t ON s.id = t.id
JOIN main.callback_instance AS i
    ON s.process_id = i.process_id AND i.start_ns < s.end_ns AND i.end_ns > s.start_ns
JOIN main.callback_alike AS k ON i.callback_id = k.callback_id
GROUP BY s.id, k.alike_id
