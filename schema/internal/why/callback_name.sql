-- title: How an explanation names callbacks
-- description: The later steps of a coroutine belong to the callback that it began in. A job on a
--     thread of no executor is one of its own, of the same node.
-- grain: one row per callback object
-- column: callback_id BIGINT  The callback object
-- column: node VARCHAR  Node
-- column: callback VARCHAR  What triggers it
-- column: function VARCHAR  Its function, without its module; NULL: not known
-- column: source VARCHAR  File and line at which the function begins; NULL: not known
-- column: process_id BIGINT  Its process
-- column: is_job BOOLEAN  It is a job
WITH begun AS (
    SELECT
        s.callback_id,
        any_value(f.callback_id) AS first_id,
        bool_and(x.thread_id IS NULL) AS is_job
    FROM main.callback_instance AS s
    JOIN main.callback_instance AS f ON s.continues_id = f.callback_instance_id
    LEFT JOIN main.executor_thread AS x ON s.thread_id = x.thread_id
    WHERE list_contains($runs, s.run_id)
    GROUP BY s.callback_id
),
-- A goal is accepted first, and executed then.
executed AS (
    SELECT
        f.callback_id,
        mode(regexp_replace(o.symbol, ' \(goes on\)$', '')) AS symbol,
        mode(o.source) AS source
    FROM main.callback_instance AS s
    JOIN main.callback_instance AS f ON s.continues_id = f.callback_instance_id
    JOIN main.callback AS k ON f.callback_id = k.callback_id
    JOIN main.callback AS o ON s.callback_id = o.callback_id
    WHERE list_contains($runs, s.run_id) AND k.kind = 'action'
    GROUP BY f.callback_id
),
named AS (
    SELECT
        c.callback_id,
        coalesce(e.symbol, c.symbol) AS symbol,
        coalesce(e.source, c.source) AS source
    FROM main.callback AS c
    LEFT JOIN executed AS e ON c.callback_id = e.callback_id
    WHERE list_contains($runs, c.run_id)
)
SELECT
    c.callback_id, n.node,
    l.label AS callback,
    -- What triggers a lambda of Python names it.
    CASE WHEN b.is_job IS NOT true THEN derive.function_name(f.symbol) END AS function,
    f.source, c.process_id,
    coalesce(b.is_job, false) AS is_job
FROM main.callback AS c
LEFT JOIN begun AS b ON c.callback_id = b.callback_id
JOIN named AS f
    ON CASE WHEN b.is_job IS FALSE THEN b.first_id ELSE c.callback_id END = f.callback_id
JOIN main.callback_label AS l ON f.callback_id = l.callback_id
JOIN main.callback_label AS n ON coalesce(b.first_id, c.callback_id) = n.callback_id
WHERE list_contains($runs, c.run_id)
