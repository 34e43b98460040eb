-- title: What a comparison begins with
-- description: The greatest change of a path, and where it comes from: the culprit on the path
--     whose harm changed most in the same direction. Then a line for each culprit that changed. Of
--     what is known to differ it is the greatest; else of what is twice as long, which is said to
--     be of too few values.
-- grain: one row per line
-- reads: compared, changed_culprit, wait_a, wait_b
WITH path AS (
    SELECT
        subject, statistic, a_ns, b_ns,
        string_split(subject, ' → ') AS steps,
        verdict IN ('B is longer', 'B is shorter') AS is_known
    FROM compared
    WHERE statistic IN ('median', 'mean', 'p95')
        AND (
            verdict IN ('B is longer', 'B is shorter')
            OR (verdict LIKE 'too few %' AND greatest(a_ns, b_ns) > 2 * least(a_ns, b_ns))
        )
    QUALIFY row_number() OVER (
        ORDER BY is_known DESC, abs(b_ns - a_ns) DESC, subject, statistic
    ) = 1
),
-- Messages for a callback wait behind earlier ones for it.
own_queue AS (
    SELECT node, callback
    FROM (
        SELECT node, callback, meanwhile_node, meanwhile_callback
        FROM wait_a
        UNION ALL
        SELECT node, callback, meanwhile_node, meanwhile_callback
        FROM wait_b
    )
    WHERE node = meanwhile_node AND callback = meanwhile_callback
),
source AS (
    SELECT
        CASE
            WHEN c.kind IN ('callback', 'computes', 'sleeps', 'disk', 'overload', 'action')
                THEN printf(
                    '%s of %s%s', coalesce(c.function, c.callback, 'the callback'), c.node,
                    CASE WHEN (c.node, c.callback) IN (SELECT (node, callback) FROM own_queue)
                        THEN ' and its queue' ELSE '' END
                )
            ELSE c.headline
        END AS words
    FROM changed_culprit AS c
    CROSS JOIN path AS p
    WHERE c.change IN (CASE WHEN p.b_ns > p.a_ns THEN 'new' ELSE 'gone' END,
        CASE WHEN p.b_ns > p.a_ns THEN 'more' ELSE 'less' END)
        AND (c.path = p.subject OR list_contains(p.steps, c.node))
    ORDER BY abs(coalesce(c.b_harm_ns, 0) - coalesce(c.a_harm_ns, 0)) DESC, c.kind, c.node
    LIMIT 1
)
SELECT line
FROM (
    SELECT
        0 AS place,
        printf(
            '%s: %s %s%s, %s to %s%s%s',
            CASE WHEN len(steps) > 3 THEN printf('%s → %s', steps[2], steps[-2])
                ELSE printf('%s → %s', steps[-2], steps[-1]) END,
            statistic,
            CASE WHEN b_ns > a_ns THEN '+' ELSE '-' END,
            main.duration_text(abs(b_ns - a_ns)), main.duration_text(a_ns),
            main.duration_text(b_ns),
            coalesce(
                CASE WHEN b_ns > a_ns THEN ', from ' ELSE ', less from ' END
                || (SELECT words FROM source),
                ''
            ),
            CASE WHEN is_known THEN '' ELSE '; too few values to exclude chance' END
        ) AS line
    FROM path
    UNION ALL
    SELECT
        row_number() OVER (),
        printf(
            '%s: %s%s', change, headline,
            CASE
                -- Of a pause or of what never came, no age is measured.
                WHEN kind IN (
                    'hangs', 'late_start', 'never_matched', 'restart', 'unfinished', 'untaken'
                )
                    THEN ''
                WHEN change IN ('more', 'less') THEN printf(
                    ' (data %s older, before %s)', main.duration_text(b_harm_ns),
                    main.duration_text(a_harm_ns)
                )
                ELSE printf(' (data %s older)', main.duration_text(coalesce(b_harm_ns, a_harm_ns)))
            END
        )
    FROM changed_culprit
    WHERE change <> 'alike'
)
ORDER BY place
