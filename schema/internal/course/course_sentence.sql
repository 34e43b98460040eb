-- description: Changes in words, each with its values over the run as a picture of 64 characters:
--     first those that no other change explains, of these the ones that explain most.
-- grain: one row per change
-- reads: change, change_named, course_line
-- param: length_ns BIGINT  From the begin of the run to its end
WITH cause AS (
    SELECT
        follows_id,
        count(*) AS changes
    FROM change
    GROUP BY follows_id
),
drawn AS (
    SELECT
        what, series_id,
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
    c.what, c.node, c.subject, c.sentence,
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
FROM change AS c
JOIN change_named AS n ON c.change_id = n.change_id
LEFT JOIN cause AS f ON c.change_id = f.follows_id
LEFT JOIN drawn AS d ON n.what = d.what AND n.series_id = d.series_id
ORDER BY
    c.follows_id IS NOT NULL, coalesce(f.changes, 0) DESC, c.at_ns, c.what, c.node, c.subject
