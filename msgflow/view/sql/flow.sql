-- description: Everything that the picked thing caused, or was caused by, or both
--     (main.flow_both), as bars, and the links between them.
-- grain: one row per vertex of the flow and link that leads to it; one for a vertex without
-- param: kind, id, direction
-- param: steps BIGINT {1..50000} = NULL  Most steps each way, three per message; any number when NULL
-- param: limit BIGINT {1..50000} = 20000  Most vertices, those nearest in time
-- column: kind UTINYINT  As in bar.sql
-- column: id, row_key
-- column: start_at BIGINT [ns since origin]  Begin
-- column: length BIGINT [ns]  Length
-- column: flags
-- column: is_effect BOOLEAN  What was picked led to it
-- column: is_cause BOOLEAN  It led to what was picked
-- column: from_kind UTINYINT  Where a link comes from; NULL: nowhere
-- column: from_id BIGINT  Its identity
-- column: link_kind
-- column: vertex_count BIGINT  Vertices of the whole flow
WITH reached AS MATERIALIZED (
    SELECT
        kind, id,
        bool_or(is_effect) AS is_effect,
        bool_or(NOT is_effect) AS is_cause
    FROM (
        SELECT
            kind, id,
            true AS is_effect
        FROM main.flow_forward($kind, $id, max_depth := $steps)
        WHERE $direction <> 'backward'
        UNION ALL
        SELECT kind, id, false
        FROM main.flow_backward($kind, $id, max_depth := $steps)
        WHERE $direction <> 'forward'
    )
    GROUP BY kind, id
),
drawn AS MATERIALIZED (
    SELECT
        c.name,
        c.code AS kind,
        r.id, r.is_effect, r.is_cause, b.row_key, b.start_ns, b.end_ns, b.flags
    FROM reached AS r
    JOIN vertex_code AS c ON r.kind = c.name
    JOIN bar AS b ON c.code = b.kind AND r.id = b.id
),
near AS MATERIALIZED (
    FROM drawn AS d
    ORDER BY
        abs(d.start_ns - (SELECT min(start_ns) FROM drawn WHERE name = $kind AND id = $id)),
        d.kind, d.id
    LIMIT $limit
),
link AS (
    SELECT l.from_kind, l.from_id, l.to_kind, l.to_id, l.link_kind
    FROM main.flow_edge AS l
    SEMI JOIN near AS f ON l.from_kind = f.name AND l.from_id = f.id
    SEMI JOIN near AS t ON l.to_kind = t.name AND l.to_id = t.id
)
SELECT
    n.kind, n.id, n.row_key,
    n.start_ns - $origin_ns AS start_at,
    n.end_ns - n.start_ns AS length,
    n.flags, n.is_effect, n.is_cause,
    c.code AS from_kind,
    l.from_id, l.link_kind,
    (SELECT count(*) FROM reached) AS vertex_count
FROM near AS n
LEFT JOIN link AS l ON n.name = l.to_kind AND n.id = l.to_id
LEFT JOIN vertex_code AS c ON l.from_kind = c.name
ORDER BY start_at, n.kind, n.id, c.code, l.from_id, l.link_kind
