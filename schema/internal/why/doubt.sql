-- title: What a recording cannot tell, or what is wrong with the system
-- description: Findings about the paths of an explanation, or about the recording as a whole. The
--     verdict has sentences of its own for others, or they delay nothing by themselves. Messages
--     that end at a node count where paths begin at it: what it publishes may be made of them.
-- grain: one row per kind of finding, three at most
-- reads: paths
-- column: name VARCHAR  Kind of finding: its file in `schema/health`
-- column: subject VARCHAR  Where it was found first
-- column: places BIGINT  At how many places
-- column: sentence VARCHAR  The sentence
WITH step AS (
    SELECT
        list_distinct(flatten(list(string_split(path, ' → ')))) AS names,
        list(string_split(path, ' → ')[1]) AS begins
    FROM paths
),
touching AS (
    SELECT
        f.name, f.title, f.subject, f.detail,
        row_number() OVER (ORDER BY f.severity, f.name, f.subject, f.detail) AS place
    FROM main.finding AS f
    LEFT JOIN main.node AS n ON f.node_id = n.node_id
    LEFT JOIN main.node AS p ON f.publishing_node_id = p.node_id
    WHERE list_contains($runs, f.run_id)
        AND f.severity IN ('error', 'warning')
        AND f.name NOT IN (
            'busy_waiting', 'executor_preempted', 'hanging_callback', 'never_taken', 'not_woken',
            'silent_topic', 'started_late', 'stopped_timer', 'unfinished_goal', 'untaken_request'
        )
        AND (f.name <> 'dead_end' OR list_contains((SELECT begins FROM step), n.full_name))
        AND (
            coalesce(f.topic_name, n.full_name, p.full_name) IS NULL
            AND (
                f.process_id IS NULL
                OR f.process_id IN (
                    SELECT m.process_id
                    FROM main.node AS m
                    WHERE list_contains((SELECT names FROM step), m.full_name)
                )
            )
            OR list_has_any(
                (SELECT names FROM step), [f.topic_name, n.full_name, p.full_name]
            )
        )
)
SELECT
    name,
    arg_min(subject, place) AS subject,
    count(*) AS places,
    printf(
        CASE name
            WHEN 'dead_end' THEN
                'flows begin at %2$s, but %3$s: if it keeps them for that, data are older '
                || '(msgflow suggest links)'
            ELSE '%s — %s: %s'
        END,
        any_value(title), arg_min(subject, place), arg_min(detail, place)
    )
    || CASE WHEN count(*) > 1 THEN printf('; %d more like this (msgflow check)', count(*) - 1)
        ELSE '' END AS sentence
FROM touching
GROUP BY name
ORDER BY min(place)
LIMIT 3
