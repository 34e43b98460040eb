-- description: Lines of samples of the system, each with the moment of the look that it is of, and
--     that of the look before: the last one that read such lines. Times that go back are of none.
-- grain: one row per line below a look
-- when: raw.usage
WITH look AS (
    SELECT
        u.file, u.number,
        f.origin_ns + staging.usage_number(split_part(u.line, chr(9), 2)) AS at_ns,
        split_part(u.line, chr(9), 3) = 'all' AS is_of_all
    FROM raw.usage AS u
    JOIN staging.usage_file AS f ON u.file = f.file
    WHERE u.line LIKE 'look' || chr(9) || '%'
),
followed AS (
    SELECT
        file, number, at_ns,
        max(at_ns) OVER earlier AS before_ns,
        max(at_ns) FILTER (WHERE is_of_all) OVER earlier AS all_before_ns
    FROM look
    WINDOW earlier AS (
        PARTITION BY file ORDER BY number ROWS BETWEEN UNBOUNDED PRECEDING AND 1 PRECEDING
    )
),
line AS (
    SELECT
        file, number, line,
        split_part(line, chr(9), 1) AS kind,
        staging.usage_number(split_part(line, chr(9), 2)) AS subject
    FROM raw.usage
    WHERE line LIKE '%' || chr(9) || '%'
)
SELECT
    l.file, l.number, l.kind, l.subject, l.line, k.at_ns,
    CASE WHEN l.kind IN ('cpu', 'host') THEN k.all_before_ns ELSE k.before_ns END AS before_ns
FROM line AS l
ASOF JOIN followed AS k ON l.file = k.file AND l.number >= k.number
WHERE k.at_ns > coalesce(k.before_ns, 0)
