-- description: Changes in words, each with its values over the run as a picture of 64 characters:
--     first those that no other change explains, of these the ones that explain most.
-- grain: one row per change
-- reads: change, course_line
-- param: length_ns BIGINT  From the begin of the run to its end
WITH named AS (
    SELECT
        *,
        CASE WHEN what = 'take' AND kind NOT IN ('step', 'trend') THEN 'taking ' ELSE '' END
        || coalesce(subject, '?')
        || CASE
            WHEN node IS NULL THEN ''
            WHEN what IN ('wait', 'queue', 'loss') THEN ' for ' || node
            WHEN what = 'take' THEN ' by ' || node
            ELSE ' of ' || node
        END AS whose
    FROM change
),
cause AS (
    SELECT
        follows,
        count(*) AS changes
    FROM change
    GROUP BY follows
),
drawn AS (
    SELECT
        what, node, subject,
        list_max(value) AS most,
        list_transform(
            range(64),
            lambda cell: list_max(
                [value[place] FOR place IN range(1, len(times) + 1)
                IF 64 * times[place] // $length_ns = cell]
            )
        ) AS highs
    FROM course_line
)
SELECT
    c.at_ns - $origin_ns AS at,
    c.what, c.node, c.subject,
    printf(
        '%s %.1f s%s: ',
        CASE
            WHEN c.kind IN ('step', 'stop') THEN 'since'
            WHEN c.kind = 'begin' THEN 'until'
            WHEN c.kind = 'trend' THEN 'steadily from'
            WHEN c.count = 1 THEN 'at'
            ELSE 'from'
        END,
        (c.at_ns - $origin_ns) / 1e9,
        coalesce(', when ' || c.since, '')
    )
        || CASE
            WHEN c.kind IN ('stop', 'begin') THEN
                printf('%s is silent, %d missing', c.whose, c.count)
            WHEN c.kind = 'gap' THEN
                printf('%s of %s, %s', derive.counted(c.count, 'pause'), c.whose, c.change)
                || coalesce(
                    printf(', while %s of %s runs', c.meanwhile_callback, c.meanwhile_node), ''
                )
            WHEN c.kind = 'burst' THEN printf('%d more of %s, %s', c.count, c.whose, c.change)
            ELSE printf(
                '%s of %s: %s',
                CASE c.what
                    WHEN 'timer' THEN 'period'
                    WHEN 'topic' THEN 'period'
                    WHEN 'take' THEN 'time between takes'
                    ELSE c.what
                END,
                c.whose, c.change
            )
        END AS sentence,
    array_to_string(
        [
            coalesce(substr('▁▂▃▄▅▆▇█', 1 + (7 * high / greatest(d.most, 1e-9))::BIGINT, 1), ' ')
            FOR high IN d.highs
        ],
        ''
    ) AS picture,
    CASE
        WHEN c.what = 'queue' THEN printf('%.0f messages', d.most)
        WHEN c.what = 'CPU use' THEN printf('%.2f CPUs', d.most)
        ELSE main.duration_text(d.most::BIGINT)
    END AS most,
    least(64 * (c.at_ns - $origin_ns) // $length_ns, 63) AS cell
FROM named AS c
LEFT JOIN cause AS f
    ON f.follows = c.what || ' ' || c.subject || coalesce(' of ' || c.node, '')
LEFT JOIN drawn AS d
    ON c.what = d.what AND c.subject = d.subject AND c.node IS NOT DISTINCT FROM d.node
ORDER BY
    c.follows IS NOT NULL, coalesce(f.changes, 0) DESC, c.at_ns, c.what, c.node, c.subject
