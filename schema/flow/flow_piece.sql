-- description: Parts of flows in pieces, between any two moments at which something begins or ends
--     that may explain a part, each with what explains it best: the lowest priority, then the
--     earliest.
-- grain: one row per piece; without an activity where nothing explains it
-- param: parts VARCHAR  Name of rows of position, from_ns, to_ns
-- param: candidates VARCHAR  Name of rows of position, priority, activity, from_ns, to_ns,
--     latest_ns (another moment at which to cut), callback_instance_id, publication_id
CREATE OR REPLACE MACRO derive.flow_piece(parts, candidates) AS TABLE
WITH clipped AS MATERIALIZED (
    SELECT
        c.position, c.priority, c.activity, c.latest_ns, c.callback_instance_id, c.publication_id,
        greatest(c.from_ns, p.from_ns) AS from_ns,
        least(c.to_ns, p.to_ns) AS to_ns
    FROM query_table(candidates) AS c
    JOIN query_table(parts) AS p ON c.position = p.position
    WHERE c.to_ns > p.from_ns AND c.from_ns < p.to_ns AND c.to_ns > c.from_ns
),
boundary AS (
    SELECT
        position,
        from_ns AS at_ns
    FROM query_table(parts)
    UNION
    SELECT position, from_ns
    FROM clipped
    UNION
    SELECT c.position, c.to_ns
    FROM clipped AS c
    JOIN query_table(parts) AS p ON c.position = p.position
    WHERE c.to_ns < p.to_ns
    UNION
    SELECT position, latest_ns
    FROM clipped
    WHERE latest_ns > from_ns AND latest_ns < to_ns
),
piece AS MATERIALIZED (
    SELECT
        b.position,
        row_number() OVER in_time AS number,
        b.at_ns AS from_ns,
        coalesce(lead(b.at_ns) OVER in_time, p.to_ns) AS to_ns
    FROM boundary AS b
    JOIN query_table(parts) AS p ON b.position = p.position
    WINDOW in_time AS (PARTITION BY b.position ORDER BY b.at_ns)
),
-- What lasts goes from one piece on to another: both ends of it are boundaries.
covering AS (
    SELECT
        c.*,
        unnest(range(f.number, l.number + 1)) AS number
    FROM clipped AS c
    JOIN piece AS f ON c.position = f.position AND c.from_ns = f.from_ns
    JOIN piece AS l ON c.position = l.position AND c.to_ns = l.to_ns
)
SELECT
    p.position, p.from_ns, p.to_ns, c.priority, c.activity, c.latest_ns, c.callback_instance_id,
    c.publication_id
FROM piece AS p
LEFT JOIN covering AS c ON p.position = c.position AND p.number = c.number
QUALIFY row_number() OVER (
    PARTITION BY p.position, p.number
    ORDER BY c.priority NULLS LAST, c.from_ns, c.callback_instance_id
) = 1
