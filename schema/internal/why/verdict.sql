-- name: internal.verdict
-- title: What makes data late, the worst first
-- description: A sentence for each culprit on the paths of an explanation. What is wrong with the
--     recording or the system as a whole comes first, then what delays data, or loses them. If
--     nothing stands out, one row says what takes most of the slowest path.
-- grain: one row per culprit
-- column: who VARCHAR  The culprit: a node, or a thread without ROS; of the recording what a
--     finding is about; NULL: nothing stands out
-- column: kinds VARCHAR[]  What it does, the worst first: 'callback', 'executor', 'cpu',
--     'service', 'queue', 'lost', 'late_start', 'stale' or 'way'; or the name of a finding
-- column: cost_ns BIGINT [ns]  By how much the data at the end of a path are older because of it;
--     NULL: of findings
-- column: path VARCHAR [path]  Path that it delays most
-- column: sentence VARCHAR  The sentence
WITH chosen AS (
    SELECT
        kind, who, what, arg_max(path, cost_ns) AS path, max(cost_ns) AS cost_ns,
        arg_max(clause, cost_ns) AS clause
    FROM suspect
    WHERE matters
    GROUP BY kind, who, what
),
told AS (
    SELECT
        who,
        list(kind ORDER BY cost_ns DESC, kind, what) AS kinds,
        max(cost_ns) AS cost_ns,
        arg_max(path, cost_ns) AS path,
        printf('%s: %s', who, string_agg(clause, '; ' ORDER BY cost_ns DESC, kind, what))
            AS sentence
    FROM chosen
    GROUP BY who
),
slowest AS (
    SELECT path, p95_ns
    FROM path_row
    WHERE p95_ns IS NOT NULL
    ORDER BY p95_ns DESC, path
    LIMIT 1
),
said AS (
    SELECT
        row_number() OVER () AS place, subject AS who, [name] AS kinds, NULL::BIGINT AS cost_ns,
        NULL::VARCHAR AS path, sentence
    FROM found
    UNION ALL
    SELECT
        1000 + row_number() OVER (ORDER BY cost_ns DESC, who), who, kinds, cost_ns, path, sentence
    FROM told
    UNION ALL
    SELECT
        1000, NULL, [], NULL, s.path,
        printf(
            'nothing stands out: the slowest path takes %s, most of it %s of %s, %s',
            main.duration_text(s.p95_ns), b.what, b.node, main.duration_text(b.p95_ns)
        )
    FROM slowest AS s
    JOIN breakdown AS b ON s.path = b.path
    WHERE NOT EXISTS (FROM told)
    QUALIFY row_number() OVER (ORDER BY b.total_ns DESC, b.hop) = 1
)
SELECT who, kinds, cost_ns, path, sentence
FROM said
ORDER BY place
