-- title: How an explanation names callbacks
-- description: The later steps of a coroutine belong to the callback that it began in.
-- grain: one row per callback object
-- column: callback_id BIGINT  The callback object
-- column: node VARCHAR  Node
-- column: callback VARCHAR  What triggers it
-- column: function VARCHAR  Its function, without its module; NULL: not known
-- column: source VARCHAR  File and line at which the function begins; NULL: not known
-- column: process_id BIGINT  Its process
WITH begun AS (
    SELECT
        s.callback_id,
        any_value(f.callback_id) AS first_id
    FROM main.callback_instance AS s
    JOIN main.callback_instance AS f ON s.continues_id = f.callback_instance_id
    WHERE list_contains($runs, s.run_id)
    GROUP BY s.callback_id
)
SELECT
    c.callback_id, l.node,
    l.label AS callback,
    -- A Python function has its module in front, a C++ function arguments and template parameters,
    -- one within the other. Of a bound method C++ keeps only the class, of a lambda where it
    -- stands.
    CASE
        WHEN regexp_matches(f.symbol, '^[^\s:(<]+:[^:]')
            THEN replace(regexp_replace(f.symbol, '^[^:]*:', ''), '.<locals>', '')
        WHEN NOT regexp_matches(f.symbol, '::\*|\{lambda') THEN nullif(trim(list_reduce(
            [f.symbol, '', '', ''],
            lambda name, _: regexp_replace(name, '\([^()]*\)|<[^<>]*>', '', 'g')
        )), '')
    END AS function,
    f.source, c.process_id
FROM main.callback AS c
LEFT JOIN begun AS b ON c.callback_id = b.callback_id
JOIN main.callback AS f ON coalesce(b.first_id, c.callback_id) = f.callback_id
JOIN main.callback_label AS l ON f.callback_id = l.callback_id
WHERE list_contains($runs, c.run_id)
