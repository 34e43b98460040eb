-- description: A sentence for each node at which flows of a result pass a link that may be another
--     one. The result (`noted`) has the way of such flows, and whether that is so (`mark`).
-- grain: one row per finding about a node on such a way, or one in all where none names a node
-- reads: noted
WITH place AS (
    SELECT DISTINCT unnest(string_split(way, ' → ')) AS name FROM noted WHERE mark
),
doubt AS (
    SELECT
        f.name, f.run_id, f.subject,
        format(
            '{}: {}, and flows through it with them. {}', f.subject, f.detail, rtrim(f.cure, '.')
        ) AS sentence
    FROM main.finding AS f
    JOIN main.node AS n ON f.node_id = n.node_id
    SEMI JOIN place AS p ON n.full_name = p.name
    WHERE list_contains($runs, f.run_id) AND f.name IN ('ambiguous_cause', 'ambiguous_link')
)
SELECT sentence
FROM (
    FROM doubt
    UNION ALL BY NAME
    SELECT
        'some flows pass a link that may be another one: candidate_count of the links' AS sentence
    WHERE EXISTS (FROM noted WHERE mark) AND NOT EXISTS (FROM doubt)
)
ORDER BY name, run_id, subject
