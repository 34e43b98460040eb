-- title: What makes data late, the worst first
-- description: A sentence for each culprit on the paths of an explanation. What is wrong with the
--     recording or the system as a whole comes first, then what delays data, or loses them. If
--     nothing stands out, one row says what takes most of the slowest path.
-- grain: one row per culprit
-- reads: breakdown, path_row, suspect
-- column: who VARCHAR  The culprit: a node, or a thread without ROS; of the recording what a
--     finding is about; NULL: nothing stands out
-- column: kinds VARCHAR[]  What it does, the worst first: 'callback', 'executor', 'cpu',
--     'service', 'queue', 'lost', 'late_start', 'stale' or 'way'; or the name of a finding
-- column: cost_ns BIGINT [ns]  By how much the data at the end of a path are older because of it;
--     half of that where it only may be so; NULL: of findings
-- column: path VARCHAR [path]  Path that it delays most: of equal ones the first by name
-- column: sentence VARCHAR  The sentence
-- column: lacks VARCHAR[]  What was not recorded that would tell whether it is so: 'kernel',
--     'callbacks'
WITH step AS (
    SELECT list_distinct(flatten(list(string_split(path, ' → ')))) AS names FROM path_row
),
-- Of these paths, or of the recording as a whole.
touching AS (
    SELECT
        f.name, f.title, f.subject, f.detail,
        row_number() OVER (ORDER BY f.severity, f.name, f.subject, f.detail) AS place
    FROM main.finding AS f
    LEFT JOIN main.node AS n ON f.node_id = n.node_id
    LEFT JOIN main.node AS p ON f.publishing_node_id = p.node_id
    WHERE list_contains($runs, f.run_id)
        AND f.severity IN ('error', 'warning')
        -- The verdict has sentences of its own for these, or they delay nothing by themselves.
        AND f.name NOT IN ('dead_end', 'executor_preempted', 'busy_waiting')
        AND (
            coalesce(f.topic_name, n.full_name, p.full_name) IS NULL
            OR list_has_any(
                (SELECT names FROM step), [f.topic_name, n.full_name, p.full_name]
            )
        )
),
found AS (
    SELECT
        min(place) AS place,
        name,
        arg_min(subject, place) AS subject,
        printf(
            '%s — %s: %s', any_value(title), arg_min(subject, place), arg_min(detail, place)
        )
        || CASE WHEN count(*) > 1
            THEN printf('; %d more like this (msgflow check)', count(*) - 1)
            ELSE '' END AS sentence
    FROM touching
    GROUP BY name
    ORDER BY place
    LIMIT 3
),
chosen AS (
    SELECT
        kind, who, what,
        arg_min(path, (-cost_ns, path)) AS path,
        max(cost_ns) AS cost_ns,
        unnest(arg_min({'clause': clause, 'lacks': lacks}, (-cost_ns, path, clause)))
    FROM (
        SELECT
            kind,
            coalesce(who, '?') AS who,
            what, path,
            coalesce(cost_ns, 0) AS cost_ns,
            lacks,
            clause || CASE lacks
                WHEN 'kernel' THEN ' (not known without a kernel trace)'
                WHEN 'callbacks' THEN ' (not known without its callbacks)'
                ELSE ''
            END AS clause
        FROM suspect
        WHERE matters AND clause IS NOT NULL
    )
    GROUP BY kind, who, what
    -- What delays less than two others of one culprit would hide the others.
    QUALIFY kind IN ('queue', 'lost', 'late_start')
        OR row_number() OVER (
            PARTITION BY who, kind IN ('queue', 'lost', 'late_start')
            ORDER BY max(cost_ns) DESC, kind, what
        ) <= 2
),
told AS (
    SELECT
        who,
        list(kind ORDER BY cost_ns DESC, kind, what) AS kinds,
        max(cost_ns) AS cost_ns,
        arg_min(path, (-cost_ns, kind, what)) AS path,
        printf('%s: %s', who, string_agg(clause, '; ' ORDER BY cost_ns DESC, kind, what))
            AS sentence,
        coalesce(list(DISTINCT lacks ORDER BY lacks) FILTER (lacks IS NOT NULL), []) AS lacks
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
        place,
        subject AS who,
        [name] AS kinds,
        NULL::BIGINT AS cost_ns,
        NULL::VARCHAR AS path,
        sentence,
        []::VARCHAR[] AS lacks
    FROM found
    UNION ALL
    SELECT
        1e6 + row_number() OVER (ORDER BY cost_ns DESC, who),
        who, kinds, cost_ns, path, sentence, lacks
    FROM told
    UNION ALL
    SELECT
        1e6, NULL,
        [],
        NULL, s.path,
        printf(
            'nothing stands out: 95 %% of the data on the slowest path arrive within %s; what takes'
            || ' longest on it is %s of %s, with up to %s',
            main.duration_text(s.p95_ns), coalesce(b.what, '?'), coalesce(b.node, '?'),
            main.duration_text(b.p95_ns)
        ),
        []
    FROM slowest AS s
    JOIN breakdown AS b ON s.path = b.path
    WHERE NOT EXISTS (FROM told)
    QUALIFY row_number() OVER (ORDER BY b.total_ns DESC, b.hop) = 1
)
SELECT who, kinds, cost_ns, path, sentence, lacks
FROM said
ORDER BY place
